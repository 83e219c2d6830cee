"""The experience study."""

import json

import numpy as np
import pytest

import nested_agents as na
from nested_agents import SpecError
from nested_agents.core.interface.measures import SUCCESS
from nested_agents.studies.catalogue.experience import analyse, check, measure, stops
from nested_agents.studies.catalogue.study import analyse_as, draw_figures, load_study
from nested_agents.studies.results import marl_eval, published
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.results import from_arrays
from nested_agents.studies.spec.outline import StudyOutline
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import SAMPLED
from nested_agents.studies.trials.trial import trials_of

PPO = {"kind": "hierarchy-ppo", "environments": 4, "rollout": 20, "batch_size": 60, "epochs": 1}
TABLE = {
    "study": "experience",
    "seeds": 1,
    "decisions": 1200,
    "steps": 25,
    "evaluation": 2,
    "scenario": {"kind": "spread"},
    "learner": PPO,
}


def test_stops_are_spaced_by_ratio():
    assert stops(30_000) == [1000, 3000, 10_000]


def test_a_trial_is_the_same_again_and_evaluates_on_the_way():
    trial = trials_of(Spec.of(TABLE))[0]
    first, again = measure(trial), measure(trial)
    assert first.rows == again.rows
    assert first.numbers == {"decisions": 1200.0}
    phases = list(dict.fromkeys(row.phase for row in first.rows))
    assert phases == [
        "training", "after 1000", "after 1000, sampled actions", "evaluation",
        "evaluation:sampled actions",
    ]  # fmt: skip
    trained = [row for row in first.rows if row.phase == "training"]
    assert [row.steps for row in trained] == [25] * 48, "1,200 decisions of four environments"
    assert [row.episode for row in trained] == list(range(48))


def test_episodes_of_all_environments_add_up_to_the_budget():
    """Carts in line stop early, so episodes end at different steps; some still run at the end."""
    looped = {**TABLE, "scenario": {"kind": "line-up", "carts": 2}, "decisions": 1000}
    result = measure(trials_of(Spec.of(looped))[0])
    steps = [row.steps for row in result.rows if row.phase == "training"]
    assert 1000 - 4 * 25 < sum(steps) <= 1000
    assert [row.episode for row in result.rows if row.phase == "training"] == [*range(len(steps))]


NAN = np.nan
UNEQUAL = {
    "td": {
        "steps": [[9, 8, 7, 6, 5, 4, 3], [9, 8, 7, 6, 5, 4, NAN]],
        "success": [[0, 0, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1, NAN]],
    }
}
"""Training of two seeds, of which one took fewer episodes for its budget."""
EVALUATED = {
    "td": {"steps": [[5, 5], [4, 6]], "success": [[1, 1], [0, 1]]},
    "random": {"steps": [[9, 9], [9, 9]], "success": [[0, 0], [0, 1]]},
}


def unequal():
    numbers = {c: {"decisions": [42, 39]} for c in EVALUATED}
    columns = {c: {"name": c} for c in EVALUATED}
    seeds = {c: (3, 7) for c in EVALUATED}
    phases = {"training": UNEQUAL, "evaluation": EVALUATED}
    return from_arrays(phases, seeds, numbers, {}, columns, (SUCCESS,))


def test_seeds_may_train_for_different_numbers_of_episodes():
    results = unequal()
    assert len(results.episodes.query("phase == 'training'")) == 13
    values = results.values("td", "success")
    assert np.isnan(values[1, 6])
    assert values[0].tolist() == [0, 0, 1, 1, 1, 1, 1]
    assert results.values("td", "success", part=slice(-2, None)).tolist() == [[1, 1], [0, 1]]
    assert results.means("td", "training").tolist() == pytest.approx([5 / 7, 1 / 6])
    assert compare_conditions(results).differences[0].estimate.value == pytest.approx(0.25 - 0.75)
    table = analyse_as("learning-curve", results)
    assert float(table.table[0].estimates["success last 5"].value) == pytest.approx((1 + 0.2) / 2)
    assert any("different numbers of episodes" in note for note in table.notes)
    assert draw_figures(load_study("learning-curve"), table)


def test_seeds_of_different_lengths_are_published_and_read(tmp_path):
    outline = StudyOutline.noted(
        {**TABLE, "seeds": [3, 7], "episodes": 1}, {c: {"name": c} for c in EVALUATED}
    )
    again = published.loads(published.dumps(outline, unequal())).results
    for name in ("steps", "success"):
        assert np.array_equal(
            again.values("td", name), unequal().values("td", name), equal_nan=True
        )
    file = json.loads(marl_eval.dumps(unequal(), dict.fromkeys(EVALUATED, "arm"), "reach"))
    runs = file["arm"]["reach"]["td"]
    counts = {name: sum(key.startswith("step_") for key in run) for name, run in runs.items()}
    assert counts == {"seed_3": 7, "seed_7": 6}


def test_sampled_actions_have_a_line_and_a_curve():
    phases = {
        "after 1000": {"ppo": {"success": [[0, 0], [0, 0]]}},
        "after 1000, sampled actions": {"ppo": {"success": [[0, 1], [1, 0]]}},
        "evaluation": {"ppo": {"success": [[0, 0], [0, 1]]}, "td": {"success": [[1, 1], [1, 1]]}},
        SAMPLED: {"ppo": {"success": [[1, 1], [1, 1]]}},
    }
    numbers = {c: {"decisions": [3000, 3000]} for c in ("ppo", "td")}
    results = from_arrays(phases, {c: (0, 1) for c in numbers}, numbers, {}, {}, (SUCCESS,))
    analysis = analyse(results)
    assert [line.condition for line in analysis.table] == ["ppo", "ppo, sampled actions", "td"]
    greedy, sampled, _ = (line.estimates for line in analysis.table)
    assert float(greedy["evaluation success"].value) == 0.25
    assert float(sampled["evaluation success"].value) == 1.0
    assert float(sampled["after 1,000"].value) == 0.5
    assert [decisions.tolist() for *_, decisions, _ in analysis.cases[:2]] == [[1000, 3000]] * 2
    figure = draw_figures(load_study("experience"), analysis)["experience"]
    *_, bar, _ = figure.axes[0].collections  # then the band of a single place, which has no area
    ((low, high),) = (segment[:, 1] for segment in bar.get_segments())
    assert 0 < low < high == 1, "the interval of the one evaluation of td"
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["ppo", "td", "sampled actions"]


def test_a_single_condition_is_called_as_its_learner():
    tables = (TABLE, {**TABLE, "preset": "paper"})
    assert [Spec.of(table).conditions()[0].label for table in tables] == ["hierarchy-ppo", "paper"]


def test_worlds_by_a_loop_and_learners_in_one_world_keep_the_budget():
    looped = {**TABLE, "scenario": {"kind": "line-up"}, "agents": "team", "decisions": 200}
    assert measure(trials_of(Spec.of(looped))[0]).numbers == {"decisions": 200.0}
    single = {"study": "experience", "seeds": 1, "decisions": 60, "steps": 25, "evaluation": 1}
    of_one = {**single, "scenario": {"kind": "line-up"}, "preset": "fitted-q"}
    assert 60 <= measure(trials_of(Spec.of(of_one))[0]).numbers["decisions"] < 85


def success(table):
    """Return the evaluation success of a trial on an arm of two joints."""
    common = {"study": "experience", "evaluation": 20, "steps": 100}
    arm = {"scenario": {"kind": "kinematic-chain", "joints": 2}}
    (trial,) = trials_of(Spec.of({**common, **arm, **table}))
    rows = [row for row in measure(trial).rows if row.phase == "evaluation"]
    return sum(row.measures["success"] for row in rows) / len(rows)


@pytest.mark.parametrize(("kind", "seed"), [("ippo", 10_000), ("hierarchy-ppo", 10_001)])
def test_networks_learn(kind, seed):
    learner = {"kind": kind, "environments": 64, "rollout": 32, "batch_size": 512, "epochs": 5}
    assert success({"seeds": [seed], "decisions": 60_000, "learner": learner}) >= 0.75
    assert success({"seeds": [seed], "decisions": 1, "preset": "random"}) <= 0.25


def test_a_report_does_without_the_success_of_episodes_in_many_worlds(tmp_path):
    cart = {"kind": "gymnasium", "id": "CartPole-v1", "predictor": "none", "success": "terminated"}
    table = {**TABLE, "decisions": 400, "scenario": cart}
    study = na.run(table, tmp_path / "out", jobs=1, progress=False)
    successes = study.episodes.query("phase == 'training'")["success"]
    assert len(successes)
    assert successes.isna().all()
    assert study.report(tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"decisions": 79}, "less than a rollout of 80 decisions in 4 environments"),
        ({"decisions": None}, "learner.environments = 4: needs a budget in decisions"),
        ({"study": "learning-curve"}, "learning-curve counts episodes"),
        ({"learner": {"kind": "ppo", "environments": 0}}, "learner.environments"),
        ({"preset": "fitted-q", "learner": {"environments": 4}}, "learner.environments"),
    ],
)
def test_bad_input_is_one_line(change, message):
    with pytest.raises(SpecError, match=message) as refusal:
        check(Spec.of({key: v for key, v in {**TABLE, **change}.items() if v is not None}))
    assert "\n" not in str(refusal.value)
    assert callable(analyse)
