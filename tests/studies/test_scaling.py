from pathlib import Path

import pytest
from made_up_results import scaling

from nested_agents.studies import scaling as module
from nested_agents.studies.results import Results
from nested_agents.studies.scaling import analyse, draw, measure, messages
from nested_agents.studies.spec import Spec
from nested_agents.studies.trial import build, check, run_trial, trials_of

SIZES = {2: 0.9, 8: 0.9, 64: 0.5}


def test_exponents_and_messages() -> None:
    analysis = analyse(scaling(SIZES))
    assert analysis.exponents["sums"]["deciding"] == pytest.approx(1.0, abs=0.02)
    assert analysis.exponents["sampling"]["deciding"] == pytest.approx(2.0, abs=0.02)
    assert [p.messages for p in analysis.points[:3]] == [6, 120, 8128]
    assert [p.evaluator for p in analysis.points] == ["sums"] * 3 + ["sampling"] * 3
    assert "64 robots: 128 agents, 8128 messages a step" in analysis.notes


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = draw(analyse(scaling(SIZES)), tmp_path)
    assert [path.name for path in paths] == ["scaling.png", "scaling.svg"]
    assert draw(analyse(Results({}, {})), tmp_path) == []


@pytest.mark.parametrize(("topology", "count"), [("chain", 6), ("star", 3), ("independent", 0)])
def test_messages_are_the_edges_of_the_transitive_closure(topology: str, count: int) -> None:
    (condition,) = Spec.of({"topology": topology}).conditions()
    hierarchy = build(condition.settings, 0)[1].hierarchy
    assert messages(hierarchy.below(i) for i in range(len(hierarchy))) == count


def test_a_trial_is_measured_without_being_changed() -> None:
    table = {"study": "scaling", "seeds": [7], "episodes": 1, "steps": 4, "evaluation": 1}
    (trial,) = trials_of(Spec.of(table))
    result = measure(trial)
    assert result.rows == run_trial(trial).rows
    assert (result.numbers["agents"], result.numbers["messages"]) == (4.0, 6.0)
    assert result.numbers["weight_bytes"] == 4 * 40 * 8
    assert result.numbers["joint_actions"] == pytest.approx(340.0), "4 + 16 + 64 + 256"
    assert 0.0 < result.usage["decision_median"] <= result.usage["decision_99"]
    assert result.usage["process_bytes"] > result.usage["step_bytes"] > 0


def test_the_spec_reaches_from_2_to_64_robots() -> None:
    spec = Spec.load(Path(module.__file__).parent / "scaling.toml")
    robots = {condition.settings.scenario.robots for condition in spec.conditions()}
    assert {2, 4, 8, 16, 32, 64} <= robots
    small = spec.model_copy(update={"overrides": spec.overrides[:1]})
    check(small)
