"""Controls differ from the team that they control in learning alone, and what is said of them."""

from pathlib import Path

import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.controls import control_of, planning_remark
from nested_agents.studies.spec.spec import Spec

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
DECISION = {"rule": "reward-and-value", "value_of": "below", "evaluator": {"kind": "best-response"}}
PLANNING = {
    "seeds": 2,
    "learner": {
        "decision": DECISION,
        "predictor": {"kind": "learned", "horizon": 2},
        "ridge": 0.1,
    },
    "scenario": {"prediction_horizon": 48},
}
FROZEN = {"name": "frozen", "preset": "frozen"}


def settings_of(spec: Spec) -> dict[str, dict]:
    return {c.label: c.settings.model_dump(mode="json") for c in spec.conditions()}


@pytest.mark.parametrize(
    "how",
    [
        {"sweep": {"preset": ["default", "frozen"]}},
        {"overrides": [{"name": "default"}, FROZEN]},
        {
            "learner": {},
            "overrides": [
                {
                    "name": "team",
                    "learner": PLANNING["learner"],
                    "sweep": {"preset": ["default", "frozen"]},
                }
            ],
        },
    ],
)
def test_a_frozen_control_keeps_what_decides_and_loses_what_learns(how) -> None:
    spec = Spec.of({**PLANNING, **how})
    team, control = (condition.settings for condition in spec.conditions())
    assert (team.learner.kind, control.learner.kind) == ("batch-td", "frozen")
    assert control.learner.decision == team.learner.decision
    assert control.learner.predictor == team.learner.predictor
    assert control.scenario == team.scenario
    assert not hasattr(control.learner, "ridge")
    assert Spec.of(spec.table()) == spec


def test_a_control_of_another_kind_than_the_team_is_frozen_all_the_same() -> None:
    spec = Spec.of(
        {"learner": {"kind": "td-lambda"}, "sweep": {"preset": ["default", "frozen", "random"]}}
    )
    assert [c.settings.learner.kind for c in spec.conditions()] == ["td-lambda", "frozen", "frozen"]


def test_controls_of_a_rule_of_their_own_keep_it() -> None:
    presets = ["default", "frozen", "random", "planner"]
    spec = Spec.of({**PLANNING, "sweep": {"preset": presets}})
    rules = [condition.settings.learner.decision.rule for condition in spec.conditions()]
    assert rules == ["reward-and-value", "reward-and-value", "random", "reward"]


@pytest.mark.parametrize(
    ("name", "controls"),
    [
        ("trained", "judge learning by the difference to frozen, same rule"),
    ],
)
def test_where_zero_weights_plan_one_remark_says_so(name: str, controls: str) -> None:
    spec = Spec.load(EXAMPLES / "pursuit_frozen.toml")
    (remark,) = [line for line in spec.warnings() if "plan" in line]
    assert remark.startswith(f"{name}: untrained weights plan by the reward under rule = ")
    assert remark.endswith(controls)
    assert planning_remark(settings_of(spec)) == remark


def test_a_missing_control_of_the_same_rule_is_asked_for() -> None:
    other = {"name": "frozen", "learner": {"kind": "frozen", "decision": {"rule": "value"}}}
    spec = Spec.of({**PLANNING, "overrides": [{"name": "trained"}, other]})
    remark = planning_remark(settings_of(spec))
    assert "no control learns nothing under the same" in remark
    assert "preset = 'frozen' with the same learner.decision" in remark


def test_equal_controls_are_one_and_it_is_said_which_is_left_out() -> None:
    same = {"name": "frozen, same rule", "preset": "frozen", "learner": {"decision": DECISION}}
    spec = Spec.of({**PLANNING, "overrides": [{"name": "trained"}, same, FROZEN]})
    assert [condition.label for condition in spec.conditions()] == ["trained", "frozen, same rule"]
    (line,) = [line for line in spec.warnings() if "the same control as" in line]
    assert line.startswith("'frozen': left out, the same control as 'frozen, same rule'; to have")


def test_what_tunes_learning_may_be_swept_beside_a_control() -> None:
    sweep = {"preset": ["default", "frozen"], "learner.ridge": [1.0, 10.0]}
    spec = Spec.of({"seeds": 2, "sweep": sweep})
    labels = [condition.label for condition in spec.conditions()]
    assert labels == ["default, ridge=1.0", "default, ridge=10.0", "frozen, ridge=1.0"]
    assert any(line.startswith("learner.ridge: left out for frozen") for line in spec.warnings())


def test_equal_teams_are_refused_and_it_is_said_what_to_do() -> None:
    with pytest.raises(SpecError, match="'a' and 'b' are the same: leave one out, or give it"):
        Spec.of({"seeds": 2, "overrides": [{"name": "a"}, {"name": "b"}]})


def test_the_control_of_a_team_decides_as_it_does() -> None:
    other = {
        "name": "frozen, by value",
        "learner": {"kind": "frozen", "decision": {"rule": "value"}},
    }
    same = {"name": "frozen, same rule", "learner": {"kind": "frozen"}}
    spec = Spec.of({**PLANNING, "overrides": [{"name": "trained"}, other, same]})
    assert control_of("trained", settings_of(spec)) == "frozen, same rule"
