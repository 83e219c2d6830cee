"""Scripted Bayesian agents against theory, in many worlds at once."""

import numpy as np
import pytest
from nested_agents_signals.scenario import SignalEnvironments, SignalsSettings
from nested_agents_signals.theory import cascade, enumerated, majority

from nested_agents import Team, build_hierarchy, parse_topology, policy_seed
from nested_agents.core.hierarchy.failures import LostMessages
from nested_agents.core.interface.experience import Observation
from nested_agents.core.learners import LEARNERS
from nested_agents.scenarios.line_up import LineUpSettings

KIND = "bayesian"
WORLDS = 4000


def team(world, topology="chain", indifferent="signal", failures=()):
    hierarchy = build_hierarchy(parse_topology(topology), world.agents)
    settings = LEARNERS.parsed(KIND, indifferent=indifferent)
    return Team(settings, world, hierarchy, policy_seed(0), failures)


def played(n, topology="chain", indifferent="signal", count=WORLDS):
    """Return who is right ``(W, n)``, and the vote ``(W,)``."""
    world = SignalsSettings(players=n, accuracy=0.7).build()
    worlds = SignalEnvironments(world, count)
    states = worlds.reset([np.random.SeedSequence(k) for k in range(count)])
    agents = team(world, topology, indifferent)
    joint = agents.act(Observation(states), explore=False).joint_action
    return worlds.plays.right(joint), worlds.plays.vote(joint), agents.hierarchy


def assert_within(outcomes, probability):
    """Check a share of independent outcomes: within four standard errors."""
    error = np.sqrt(probability * (1 - probability) / len(outcomes))
    assert (np.abs(outcomes.mean(axis=0) - probability) < 4 * error).all()


@pytest.mark.parametrize("indifferent", ["signal", "coin"])
@pytest.mark.parametrize("n", [2, 7, 64])
def test_a_chain_herds_as_theory_says(n, indifferent):
    right, vote, _ = played(n, indifferent=indifferent)
    theory = cascade(n, 0.7, indifferent)
    assert_within(right, theory.right)
    assert_within(vote, theory.vote)


@pytest.mark.parametrize("topology", ["tree:2", "star", "random:3"])
def test_other_hierarchies_are_as_if_all_signals_were_tried(topology):
    right, vote, hierarchy = played(9, topology)
    theory = enumerated(hierarchy, 0.7)
    assert_within(right, theory.right)
    assert_within(vote, theory.vote)


def test_who_is_told_nothing_names_its_signal():
    right, vote, _ = played(31, "independent")
    assert_within(right, np.full(31, 0.7))
    assert_within(vote, majority(31, 0.7))


def test_one_world_is_as_many():
    world = SignalsSettings(players=6).build()
    agents = team(world)
    worlds = SignalEnvironments(world, 8)
    seeds = [np.random.SeedSequence(k) for k in range(8)]
    together = agents.act(Observation(worlds.reset(seeds)), explore=False).joint_action
    alone = [agents.act(Observation(world.reset(seed))).joint_action for seed in seeds]
    assert np.array_equal(together, alone)


def test_what_they_cannot_weigh_is_refused():
    with pytest.raises(ValueError, match=r"needs scenario\.kind = 'signals'"):
        team(LineUpSettings(carts=3).build())
    world = SignalsSettings(players=3).build()
    with pytest.raises(ValueError, match="agent3 hears agent2, but not all"):
        team(world, {"kind": "chain", "communication": "parents"})
    with pytest.raises(ValueError, match=r"remove topology\.failures"):
        team(world, failures=(LostMessages(agents=("*",)),))
