"""The experience study."""

import pytest

import nested_agents as na
from nested_agents import SpecError
from nested_agents.studies.catalogue.experience import analyse, check, measure, stops
from nested_agents.studies.spec.spec import Spec
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
    assert phases[:3] == ["training", "after 1000", "evaluation"]
    trained = [row for row in first.rows if row.phase == "training"]
    assert [row.steps for row in trained] == [25] * 12
    assert [row.episode for row in trained] == list(range(12))


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
