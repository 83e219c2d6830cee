"""Best responses of an arm at once: the very joint actions of agents asked one by one."""

from itertools import pairwise

import numpy as np
import pytest
from acting import fuzzy, joint_of

from nested_agents.core.agents.loop import policy_seed, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.kinematic_chain.scenario import ChainPrediction

DECISION = {"value_of": "team", "evaluator": "best-response"}


def decisions(settings, number, *, explore=True, weights="role", backwards=False):
    """Return joint actions, the next random number and the joint actions tried of a team."""
    scenario = settings.build()
    order = scenario.agents[::-1] if backwards else scenario.agents
    learner = BatchTDSettings(decision=DECISION, weights=weights)
    hierarchy = Hierarchy(scenario.agents, list(pairwise(order)))
    team = Team(learner, scenario, hierarchy, policy_seed(0))
    theta = fuzzy(team).learner.theta
    theta[:] = np.random.default_rng(1).normal(scale=0.01, size=theta.shape)
    scenario.reset(world_seed(0, 0), 0)
    team.reset(0, 0, learn=True)
    taken = []
    for _ in range(number):
        taken.append(joint_of(team, scenario, explore=explore).copy())
        scenario.step(taken[-1])
    return (
        np.array(taken),
        fuzzy(team).rng.random(),
        fuzzy(team).evaluator.counts.joint_actions,
    )


def are_equal(settings, number, monkeypatch, **options):
    """Return whether they are the same as those of agents who are asked one by one."""
    asked = []
    respond = ChainPrediction._respond
    counted = lambda *all: asked.append(1) or respond(*all)  # noqa: E731
    monkeypatch.setattr(ChainPrediction, "_respond", counted)
    at_once = decisions(settings, number, **options)
    assert len(asked) == number
    monkeypatch.setattr(ChainPrediction, "best_responses", lambda self, rules: None)
    one_by_one = decisions(settings, number, **options)
    return all(np.array_equal(*pair) for pair in zip(at_once, one_by_one, strict=True))


@pytest.mark.parametrize(
    ("settings", "options"),
    [
        ({"joints": 16}, {}),
        ({"joints": 16, "speed": 1.0}, {"explore": False}),
        ({"joints": 32, "predictor": "informed",
          "failures": [{"kind": "locked", "joints": "joint2"}]}, {"weights": "own"}),
        ({"joints": 3, "speed": 3.0}, {"backwards": True}),
        ({"joints": 64}, {}),
    ],
)  # fmt: skip
def test_the_same_joint_actions(settings, options, monkeypatch):
    assert are_equal(KinematicChainSettings(**settings), 12, monkeypatch, **options)


@pytest.mark.slow
def test_the_same_joint_actions_of_256_joints(monkeypatch):
    assert are_equal(KinematicChainSettings(joints=256), 12, monkeypatch)


def test_other_variables_are_asked_one_by_one():
    settings = KinematicChainSettings(joints=3, state_space=("bearing", "distance"))
    scenario = settings.build()
    scenario.reset(0)
    team = Team(
        BatchTDSettings(decision=DECISION), scenario, Hierarchy(scenario.agents, []), policy_seed(0)
    )
    assert scenario.predict().best_responses(fuzzy(team).learner.rules) is None
