"""The single agent over the joint state is the same world, seen as that of one agent."""

from itertools import product

import numpy as np
import pytest

from nested_agents.core.agents.loop import control_loop
from nested_agents.core.agents.single_agent import SingleAgent
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.hierarchy import Hierarchy
from nested_agents.core.learners.td import TDLambdaSettings
from nested_agents.core.rules.settings import RuleBaseSettings


@pytest.fixture
def pair(line_world):
    """A world of two agents and the same one seen as one agent's, in the same state."""
    world, single = line_world(2, 1), SingleAgent(line_world(2, 1))
    assert (single.reset(1) == world.reset(1).reshape(1, -1)).all()
    return world, single


def test_one_agent_with_all_joint_actions_and_variables(pair) -> None:
    _, single = pair
    assert (single.agents, single.groups) == (("single",), ((0,),))
    assert len(single.action_set) == 16
    assert single.action_set.names[:3] == (
        "increase+increase", "increase+decrease", "increase+maintain",
    )  # fmt: skip
    assert single.action_set.names[single.action_set.neutral] == "maintain+maintain"
    names = [v.name for v in single.state_space.variables]
    assert names[:4] == ["cart0.wheel0.speed", "cart0.wheel0.phase", "cart0.wheel0.gap",
                         "cart1.wheel0.speed"]  # fmt: skip
    assert single.state_space.n_variables == 6


def test_steps_are_those_of_the_world(pair) -> None:
    world, single = pair
    for code, joint in enumerate(product(range(4), repeat=2)):
        expected, found = world.step(np.array(joint)), single.step(np.array([code]))
        assert (found.states == expected.states.reshape(1, -1)).all()
        assert (found.reward, found.info) == (expected.reward, expected.info)
    assert single.scenario.measure() == world.measure()


def test_predictions_are_those_of_the_world(pair) -> None:
    world, single = pair
    prediction, expected = single.predict(), world.predict()
    joint = np.array(list(product(range(4), repeat=2)))
    codes = np.arange(16)[:, None]
    both = np.concatenate([expected.states(i, joint) for i in range(2)], axis=1)
    assert (prediction.states(0, codes) == both).all()
    assert (prediction.rewards(codes) == expected.rewards(joint)).all()
    assert (prediction.reward_table() == expected.reward_table()).all()
    blocks = prediction.blocks(0)
    assert (blocks.states(np.arange(16)) == both).all()


def test_a_team_of_one_acts_and_learns(pair) -> None:
    _, single = pair
    settings = TDLambdaSettings(rule_base=RuleBaseSettings(memberships=2, order=6), step_size=0.1)
    team = Team.build(settings, single, Hierarchy(["single"], []), np.random.SeedSequence(1))
    records = list(control_loop(single, team, episodes=2, steps=5, seed=1))
    assert len(records) == 10
    assert team.learner.theta.shape == (1, 2**6)
    assert np.abs(team.learner.theta).max() > 0
    assert team.evaluator.counts.joint_actions == 10 * 16


def test_too_many_joint_actions_are_refused(line_world) -> None:
    with pytest.raises(ValueError, match=r"single agent: 4 \*\* 7 actions, allowed: 4096 or fewer"):
        SingleAgent(line_world(7, 1))
