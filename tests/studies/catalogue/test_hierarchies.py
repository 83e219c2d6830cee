"""The hierarchies study on made-up results, whose answer is known, and on one tiny run."""

from pathlib import Path

import made_up
import pytest
from made_up_results import NOTHING, hierarchies

from nested_agents.studies.catalogue import hierarchies as module
from nested_agents.studies.catalogue.hierarchies import analyse, check, draw, measure
from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.power import seeds_needed
from nested_agents.studies.results.results import read
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers import runner

CHANCES = {
    (topology, value_of, robots): chance if robots > 2 and value_of == "team" else 0.9
    for topology, chance in {"star": 0.2, "chain": 0.9, "tree:2": 0.9}.items()
    for value_of in ("own", "team")
    for robots in (2, 8)
}


def test_where_a_hierarchy_matters_is_told_and_where_not() -> None:
    analysis = analyse(hierarchies(CHANCES).frames())
    assert list(analysis.differences) == [
        "2 robots, own", "2 robots, team", "8 robots, own", "8 robots, team",
    ]  # fmt: skip
    *others, (star, tree) = analysis.differences.values()
    assert all(d.p > 0.05 for group in others for d in group)
    assert (star.condition, star.seeds, tree.condition) == ("star", 20, "tree:2")
    assert star.p < 0.05 < tree.p
    assert star.estimate.low < -0.7 < star.estimate.high < -0.4
    text = "\n".join(analysis.notes)
    of_team = "8 robots, team: evaluation success, minus that of chain:\n  worse: star, -0."
    assert of_team in text
    assert "adjusted over 8 comparisons (Holm)." in text
    assert max(map(len, text.splitlines())) <= 80


def test_differences_are_those_that_compare_prints() -> None:
    frames = hierarchies(CHANCES).frames()
    (star,) = [d for d in analyse(frames).differences["8 robots, team"] if d.condition == "star"]
    compared = compare_conditions(frames, by="topology", reference="chain")
    (same,) = [d for d in compared.differences if d.condition == "star"][-1:]
    assert (star.shown, star.seeds) == (same.shown, same.seeds)


def test_a_setting_without_the_reference_is_named() -> None:
    known = {key: chance for key, chance in CHANCES.items() if key != ("chain", "team", 8)}
    analysis = analyse(hierarchies(known).frames())
    assert "8 robots, team" not in analysis.differences
    (said,) = [line for line in analysis.notes if line.startswith("Not compared")]
    assert "chain" in said
    assert "8 robots, team" in said


def test_with_few_seeds_nothing_can_be_told() -> None:
    analysis = analyse(hierarchies(CHANCES, seeds=5).frames())
    text = "\n".join(analysis.notes)
    assert "8 comparisons), whatever the outcome" in text
    assert "worse" not in text


@pytest.mark.parametrize("comparisons", [1, 8, 63, 1000])
def test_the_seeds_needed_are_the_fewest_whose_least_p_is_small_enough(comparisons: int) -> None:
    n = seeds_needed(comparisons)
    assert 2.0 ** (1 - n) * comparisons < 0.05 <= 2.0 ** (2 - n) * comparisons


def test_the_first_hierarchy_is_the_reference_where_there_is_no_chain() -> None:
    chances = {key: chance for key, chance in CHANCES.items() if key[0] != "chain"}
    assert "2 robots, own: evaluation success, minus that of star:" in (
        analyse(hierarchies(chances).frames()).notes
    )


def test_what_the_reference_has_not_finished_is_not_compared() -> None:
    results = hierarchies(CHANCES)
    for arrays in (results.training, results.evaluation):
        arrays.pop("topology=chain, value_of=team, robots=8")
    results.seeds["topology=chain, value_of=own, robots=8"] = tuple(range(40, 60))
    analysis = analyse(results.frames())
    assert list(analysis.differences) == ["2 robots, own", "2 robots, team", "8 robots, own"]
    assert not any(d.paired for d in analysis.differences["8 robots, own"])
    assert len(analysis.table) == 11


def test_costs_stand_beside_success() -> None:
    analysis = analyse(hierarchies(CHANCES).frames())
    by_name = {line.condition: line.estimates for line in analysis.table}
    assert list(by_name)[:3] == [
        "2 robots, own, star", "2 robots, own, chain", "2 robots, own, tree:2",
    ]  # fmt: skip
    chain = by_name["8 robots, own, chain"]
    titles = ["evaluation success", "decisions to goal", "decision time [ms]", "messages"]
    assert list(chain) == titles
    assert chain["messages"].value == 120.0
    assert 1.4 < chain["decision time [ms]"].low < 1.6 < chain["decision time [ms]"].high < 1.8
    assert 30.0 < chain["decisions to goal"].value < 90.0
    assert tabulate(analysis.table).csv.count("\n") == 13


def test_who_never_succeeds_has_no_decisions_to_the_goal() -> None:
    results = hierarchies({("chain", "own", 2): 0.0, ("star", "own", 2): 0.0})
    for line in analyse(results.frames()).table:
        assert "decisions to goal" not in line.estimates


def test_hierarchies_may_be_overrides_and_value_of_need_not_be_swept() -> None:
    results = hierarchies({("chain", "own", 2): 0.9, ("star", "own", 2): 0.9})
    for condition, columns in results.columns.items():
        results.columns[condition] = {"name": columns["topology"], "scenario.carts": 2}
    assert [line.condition for line in analyse(results.frames()).table] == [
        "2 carts, chain", "2 carts, star",
    ]  # fmt: skip
    for columns in results.columns.values():
        del columns["scenario.carts"]
    assert [line.condition for line in analyse(results.frames()).table] == ["chain", "star"]
    results.numbers["topology=star, value_of=own, robots=2"]["robots"][:] = 4.0
    assert {c.setting for c in analyse(results.frames()).cases} == {
        "2 agent groups", "4 agent groups",
    }  # fmt: skip


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    partly = {key: chance for key, chance in CHANCES.items() if key[:2] != ("star", "own")}
    for chances, columns in ((CHANCES, 2), (partly, 2)):
        (figure,) = draw(analyse(hierarchies(chances).frames())).values()
        assert len(figure.axes) == 3 * columns
    paths = save({"hierarchies": figure}, tmp_path)
    assert all(path.stat().st_size > 0 for path in paths)
    assert draw_figures(module, analyse(NOTHING)) == {}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"evaluation": 0}, "evaluation = 0: hierarchies compares evaluation success"),
        ({"sweep": {"scenario": {"robots": [2, 4]}}}, "topology = 'chain' in every condition"),
    ],
)
def test_what_cannot_be_compared_is_refused(changes: dict, said: str) -> None:
    table = {"study": "hierarchies", "sweep": {"topology": ["chain", "star"]}}
    check(Spec.of(table))
    with pytest.raises(SpecError, match=said):
        check(Spec.of({**table, **changes}))


def test_a_tiny_study_is_run_and_read(tmp_path: Path) -> None:
    spec = Spec.of(
        {
            "study": "hierarchies", "seeds": [7, 8], "episodes": 1, "steps": 3, "evaluation": 1,
            "learner": {"weights": "role", "decision": {"evaluator": "best-response"}},
            "overrides": [{"name": "chain"}, {"name": "chain of robots", "agents": "body"}],
            "sweep": {
                "learner.decision.value_of": ["own", "team"],
                "scenario.robots": [1, 2],
            },
        }
    )  # fmt: skip
    with made_up.opened(tmp_path, spec, check_conditions(spec)) as store:
        for trial in trials_of(spec):
            runner.save(store, trial, measure(trial), 1.0)
        results = read(store)
    analysis = analyse(results)
    assert [line.condition for line in analysis.table[:5]] == [
        "1 robot, own, chain", "1 robot, own, chain of robots",
        "1 robot, team, chain", "1 robot, team, chain of robots",
        "2 robots, own, chain",
    ]  # fmt: skip
    messages = [float(line.estimates["messages"].value) for line in analysis.table]
    assert messages == [1.0, 0.0, 1.0, 0.0, 6.0, 1.0, 6.0, 1.0]
    assert len(analysis.differences) == 4


def test_the_spec_crosses_hierarchies_whose_value_and_sizes_over_seeds_enough() -> None:
    spec = Spec.load(Path(module.__file__).parent / "hierarchies.toml")
    check(spec)
    conditions = spec.conditions()
    assert len(conditions) == 8 * 3 * 2
    compared = len(conditions) - 3 * 2
    assert len(spec.seeds) >= seeds_needed(compared)
    searches = {c.settings.learner.decision.evaluator.kind for c in conditions}
    assert searches == {"best-response"}
    assert {c.settings.scenario.robots for c in conditions} == {2, 8}
