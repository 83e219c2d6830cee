"""PPO in many environments: equal bits, communication, every scenario that networks can play."""

from itertools import pairwise

import numpy as np
import pytest

from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.many_environments import ManyEnvironmentsLoop
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LeftAgents
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Observation
from nested_agents.core.interface.scenario import checked_scenario
from nested_agents.core.interface.stacked import make_environments
from nested_agents.core.learners import LEARNERS
from nested_agents.scenarios import SCENARIOS

SMALL = {"environments": 4, "rollout": 10, "batch_size": 30, "epochs": 2, "hidden": (8,)}
KINDS = ("hierarchy-ppo", "mappo", "ippo", "ppo")
SPREAD = {"kind": "spread"}
TABLES = {
    "spread": {"kind": "spread", "most_decisions": 7},
    "line-up": {"kind": "line-up", "carts": 3},
    "arm": {"kind": "kinematic-chain", "joints": 4, "most_decisions": 9},
    "climbing": {"kind": "matrix-game", "game": "stochastic-climbing"},
    "polymatrix": {"kind": "team-game", "players": 5, "numbered": True},
    "landmarks": {"kind": "team-game", "game": "landmarks", "players": 4, "numbered": True},
    "signals": {"kind": "signals", "players": 4},
    "box": {"kind": "box-pushing"},
    "box, pay by robot": {"kind": "box-pushing", "robots": 3, "reward": {"of": "robot"}},
    "Gymnasium": {
        "kind": "gymnasium", "id": "BipedalWalker-v3", "actions": 2,
        "variables": {"angle": 0, "speed": 2},
    },
}  # fmt: skip


def build(table):
    table = dict(table)
    return checked_scenario(SCENARIOS.parsed(table.pop("kind"), **table).build())


def team_of(kind="hierarchy-ppo", table=SPREAD, seed=0, failures=(), **changes):
    world = build(table)
    settings = LEARNERS.model(kind).model_validate({"kind": kind, **SMALL, **changes})
    chain = Hierarchy(world.agents, list(pairwise(world.agents)))
    return Team(settings, world, chain, policy_seed(seed), failures)


def loop_of(team, table=SPREAD, most=1000):
    count = SMALL["environments"]
    many = make_environments(lambda: build(table), count)
    return ManyEnvironmentsLoop(many, team, most, 0)


def weights(team):
    return np.concatenate([policy.weights for policy in team.parts[0].policies.values()])


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("kind", ["hierarchy-ppo", "ppo"])
def test_networks_learn_in_every_scenario(kind, name):
    table = TABLES[name]
    teams = [team_of(kind, table) for _ in range(2)]
    before = weights(teams[0])
    for team in teams:
        loop = loop_of(team, table, most=6)
        for _ in range(SMALL["rollout"]):
            loop.step()
    assert np.array_equal(weights(teams[0]), weights(teams[1]))
    assert np.isfinite(weights(teams[0])).all()
    assert not np.array_equal(weights(teams[0]), before)


@pytest.mark.parametrize("kind", KINDS)
def test_environments_decide_as_each_by_itself_and_in_any_order(kind):
    team, world = team_of(kind), build(SPREAD)
    states = np.stack([world.reset(seed) for seed in range(9)])
    together = team.act(Observation(states), explore=False).joint_action
    alone = [team.act(Observation(own), explore=False).joint_action for own in states]
    assert np.array_equal(together, np.stack(alone))
    order = np.random.default_rng(0).permutation(9)
    mixed = team.act(Observation(states[order]), explore=False).joint_action
    assert np.array_equal(mixed, together[order])


def test_permuting_agents_permutes_their_actions():
    team, world = team_of("ippo", numbered=False), build(SPREAD)
    states = np.stack([world.reset(seed) for seed in range(9)])
    plain = team.act(Observation(states), explore=False).joint_action
    order = np.array([2, 0, 1])
    mixed = team.act(Observation(states[:, order]), explore=False).joint_action
    assert np.array_equal(mixed, plain[:, order])


def test_agents_see_what_they_are_told():
    team, world = team_of(), build(SPREAD)
    states = np.stack([world.reset(seed) for seed in range(4)])
    decision = team.act(Observation(states))
    told = decision.inputs[0].actor[:, :, : len(team.parts[0].told_names)]
    assert not told[:, 0].any()
    assert (told[:, 1, :5].argmax(axis=1) == decision.joint_action[:, 0]).all()
    assert (told.sum(axis=2) == [0, 1, 2]).all()


def test_agents_without_a_stochastic_policy_explore_again_after_an_evaluation():
    team = team_of()
    team.parts[0].is_stochastic = False
    loop = loop_of(team)
    list(control_loop(build(SPREAD), team, episodes=1, steps=2, seed=0, learn=False))
    before = team.parts[0].rng.bit_generator.state
    loop.step()
    assert team.parts[0].rng.bit_generator.state != before


@pytest.mark.parametrize("weights", ["all", "own"])
def test_the_reward_of_the_team_is_the_mean_of_all_agents(weights):
    team = team_of(weights=weights)
    loop = loop_of(team)
    rewards = []
    step = loop._environments.step
    loop._environments.step = lambda joint: rewards.append(step(joint)) or rewards[-1]
    loop.step()
    assert np.ptp(rewards[0].rewards, axis=1).any()
    for policy in team.parts[0].policies.values():
        expected = np.clip(rewards[0].rewards.mean(axis=1) / policy._moments.deviation, -10, 10)
        for of_agent in policy.rollout.rewards[0].T:
            assert of_agent == pytest.approx(expected, rel=1e-6)


def test_messages_that_fail_are_refused():
    with pytest.raises(ValueError, match=r"learner.environments = 4: .* one environment") as raised:
        team_of(failures=(LeftAgents(agents=("agent1",), episode=1),))
    assert "\n" not in str(raised.value)
