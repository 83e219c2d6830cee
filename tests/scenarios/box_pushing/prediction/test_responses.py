"""Best responses of all robots at once: the very joint actions of agents asked one by one."""

from itertools import pairwise

import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.core.agents.loop import policy_seed, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.search.best_response import BestResponse
from nested_agents.core.search.evaluator import Evaluator
from nested_agents.core.values.rule_base import RuleBaseSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.prediction import BoxPrediction

DECISION = {"value_of": "team", "evaluator": "best-response"}
PRODUCTS = RuleBaseSettings(order=2)
SIX = tuple(f"robot{r}.{side}" for r in (3, 1, 2) for side in ("left", "right"))


def decisions(settings, number, *, explore=True, weights="role", order=None, rules=None, digits=9):
    """Return joint actions, the next random number and the joint actions tried of a team."""
    scenario = BoxPushingSettings(**settings).build()
    learner = BatchTDSettings(decision=DECISION, weights=weights, rule_base=rules or {})
    hierarchy = Hierarchy(scenario.agents, list(pairwise(order or scenario.agents)))
    team = Team(learner, scenario, hierarchy, policy_seed(0))
    theta = fuzzy(team).learner.theta
    theta[:] = np.random.default_rng(1).normal(scale=0.01, size=theta.shape).round(digits)
    scenario.reset(world_seed(0, 0), 0)
    team.reset(0, 0, learn=True)
    taken = []
    for _ in range(number):
        taken.append(joint_of(team, scenario, explore=explore).copy())
        scenario.step(taken[-1])
    counted = fuzzy(team).evaluator.counts
    return np.array(taken), fuzzy(team).rng.random(), counted.joint_actions


def at_once_and_one_by_one(monkeypatch, settings, options, number=12):
    """Return what a team does at once, what it does one by one, and how often it was at once."""
    asked = []
    respond = BoxPrediction._respond
    counted = lambda *all: asked.append(1) or respond(*all)  # noqa: E731
    monkeypatch.setattr(BoxPrediction, "_respond", counted)
    at_once = decisions(settings, number, **options)
    monkeypatch.setattr(BoxPrediction, "best_responses", lambda self, rules: None)
    return at_once, decisions(settings, number, **options), len(asked)


@pytest.mark.parametrize(
    ("settings", "options"),
    [
        ({"robots": 4, "state_space": "crowd"}, {}),
        ({"robots": 4, "state_space": "crowd"}, {"explore": False, "digits": 2}),  # many ties
        ({"robots": 4, "state_space": "crowd"}, {"weights": "own", "digits": 2}),
        ({"robots": 3, "state_space": "crowd"}, {"order": SIX}),
        ({"robots": 3, "state_space": "relational"}, {"rules": PRODUCTS}),
        ({"robots": 1, "state_space": "pose"}, {}),
        ({"robots": 2, "state_space": "paper"}, {}),
        ({"robots": 5, "state_space": "crowd", "box": "rectangle"}, {}),
        ({"robots": 24, "state_space": "crowd"}, {}),
        ({"robots": 70, "state_space": "crowd"}, {"weights": "own"}),
        ({"robots": 2, "robot": "four-wheel", "state_space": "crowd"}, {}),
        ({"robots": 3, "predictor": "rigid", "state_space": "crowd",
          "failures": [{"kind": "seized", "wheels": "robot1.left"}]}, {}),
    ],
)  # fmt: skip
def test_the_same_joint_actions(settings, options, monkeypatch) -> None:
    at_once, one_by_one, asked = at_once_and_one_by_one(monkeypatch, settings, options)
    assert asked == 12
    for one, other in zip(at_once, one_by_one, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("settings", "options"),
    [
        ({"robots": 2, "predictor": "exact", "state_space": "crowd"}, {}),
        ({"robots": 2}, {"rules": RuleBaseSettings(membership="sigmoid")}),
        ({"robots": 3}, {"order": [*SIX[::2], *SIX[1::2]]}),
        ({"robots": 3}, {"order": SIX[::-1]}),
    ],
)
def test_all_else_is_asked_one_by_one(settings, options, monkeypatch) -> None:
    assert at_once_and_one_by_one(monkeypatch, settings, options, 2)[2] == 0


@pytest.mark.parametrize("explore", [True, False])
def test_before_anything_is_learned_all_draw_at_once(explore, monkeypatch) -> None:
    nothing = {"digits": 0, "explore": explore}
    at_once = decisions({"robots": 3}, 20, **nothing)
    monkeypatch.setattr(BestResponse, "decide", Evaluator.decide)
    one_by_one = decisions({"robots": 3}, 20, **nothing)
    for one, other in zip(at_once, one_by_one, strict=True):
        np.testing.assert_array_equal(one, other)


def test_values_that_are_no_numbers_are_refused() -> None:
    scenario = BoxPushingSettings(robots=3).build()
    hierarchy = Hierarchy(scenario.agents, list(pairwise(scenario.agents)))
    team = Team(BatchTDSettings(decision=DECISION), scenario, hierarchy, policy_seed(0))
    fuzzy(team).learner.theta[:] = np.nan
    scenario.reset(0)
    with pytest.raises(ArithmeticError, match="not all values are numbers"):
        joint_of(team, scenario)
