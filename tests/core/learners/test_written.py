"""A written value is the formula that a person wrote, and enough to push a box to its goal."""

import numpy as np
import pytest

import nested_agents as na
from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.learners.written import Written, WrittenSettings
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

SPACE = StateSpace(
    "demo",
    (
        Variable("gap", "m", 0.0, 2.0, centers=(0.0, 0.5, 2.0)),
        Variable(
            "bearing", "rad", -np.pi, np.pi, periodic=True, centers=(-2.0, -0.5, 0.0, 0.5, 2.0)
        ),
    ),
)  # fmt: skip
VALUE = {"gap": -1.0, "bearing": -0.1}
ROWS = np.array([0, 1, 0])


def written(value=VALUE, **rules) -> Written:
    rule_base = RuleBaseSettings(**rules)
    return Written(WrittenSettings(value=value), RuleBase.build(SPACE, rule_base), ROWS)


def test_the_value_is_the_formula() -> None:
    learner = written()
    states = np.array([[0.0, 0.0], [0.25, 1.25], [1.7, -1.0], [3.0, 0.0]])
    values = RuleBase.build(SPACE, RuleBaseSettings()).values(learner.theta[0], states)
    by_hand = [0.0, -0.25 - 0.125, -1.7 - 0.1, -2.0]  # beyond the outermost center it stays
    np.testing.assert_allclose(values, by_hand)
    assert learner.theta.shape == (2, 8)
    assert (learner.theta[0] == learner.theta[1]).all()


def test_it_never_learns() -> None:
    learner = written()
    before = learner.theta.copy()
    learner.begin_episode()
    states = np.zeros((3, 2))
    assert learner.observe(states, 1.0, terminated=False) == 0
    assert learner.observe(states, 1.0, terminated=True) == 0
    assert learner.end_episode() == 0
    assert (learner.theta == before).all()
    again = written({"gap": 5.0})
    again.load_state_dict(learner.state_dict())
    assert (again.theta == before).all()


@pytest.mark.parametrize(
    ("value", "rules", "message"),
    [
        ({"gapp": -1.0}, {}, "learner.value.gapp: unknown state variable, known: gap, bearing"),
        (VALUE, {"order": 2}, "learner.rule_base.order: must be 1"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(value, rules, message: str) -> None:
    with pytest.raises(ValueError, match=message) as refusal:
        written(value, **rules)
    assert "\n" not in str(refusal.value)


def test_an_unknown_variable_of_a_spec_is_one_line() -> None:
    spec = Spec.of({"preset": "hand-written", "seeds": 1, "learner": {"value": {"gapp": 1.0}}})
    with pytest.raises(SpecError, match=r"learner\.value\.gapp: unknown state variable") as refusal:
        check_conditions(spec)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("scenario", "own", "value"),
    [
        ("box-pushing", {}, {"box_distance", "contact_cross_track_error", "gap", "face_bearing"}),
        ("kinematic-chain", {}, {"distance"}),
        ("line-up", {"lead": -1.0}, {"lead"}),
    ],
)
def test_the_preset_has_the_value_of_its_scenario(scenario, own, value) -> None:
    table = {"scenario": {"kind": scenario}, "learner": {"value": own} if own else {}}
    spec = Spec.of({"preset": "hand-written", "seeds": 1, **table})
    (condition,) = spec.conditions()
    assert set(condition.settings.learner.value) == value
    check_conditions(spec)
    assert not condition.settings.remarks()


def test_a_value_of_nothing_is_said_to_be_one() -> None:
    spec = Spec.of({"preset": "hand-written", "seeds": 1, "scenario": {"kind": "line-up"}})
    expected = "learner.value = {}: all states have the value 0"
    assert any(line.startswith(expected) for line in spec.warnings())


@pytest.mark.slow
def test_what_a_person_wrote_brings_the_box_to_its_goal(tmp_path) -> None:
    table = {"seeds": [10_000, 10_001], "episodes": 1, "steps": 450, "evaluation": 5}
    study = na.run({"preset": "hand-written", **table}, tmp_path, jobs=1, progress=False)
    success = study.results.success("hand-written", "evaluation")
    assert success.mean() >= 0.7
