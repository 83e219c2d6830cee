"""Agents that leave and come, and what becomes of the hierarchy."""

from itertools import pairwise

import numpy as np
import pytest
from acting import fuzzy, look
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import AbsentAgents, LeftAgents
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.hierarchy.messages import Messages
from nested_agents.core.hierarchy.repair import without
from nested_agents.core.learners import LEARNERS
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.topologies.builders import random_hierarchy

NAMES = "abcdef"
TREE = Hierarchy(NAMES, [("a", "b"), ("a", "c"), ("b", "d"), ("b", "e"), ("c", "f")])


@pytest.mark.parametrize(
    ("gone", "rule", "edges"),
    [
        ([1], "grandparents", ["ac", "ad", "ae", "cf"]),
        ([1], "next", ["ac", "ad", "cf", "de"]),
        ([1], "none", ["ac", "cf"]),
        ([0], "grandparents", ["bd", "be", "cf"]),
        ([0], "next", ["bc", "bd", "be", "cf"]),
        ([0, 1], "next", ["cd", "ce", "cf"]),
        ([0, 1, 2], "grandparents", []),
        ([5], "next", ["ab", "ac", "bd", "be"]),
    ],
)
def test_who_stands_above_whom_then(gone, rule, edges) -> None:
    left = without(TREE, gone, rule)
    assert sorted(NAMES[a] + NAMES[b] for a, b in left.edges) == edges
    assert len(TREE.edges) == 5


@given(st.integers(0, 50), st.sets(st.integers(0, 6), max_size=6))
def test_whoever_is_there_keeps_its_ancestors_by_grandparents_alone(seed, gone) -> None:
    names = list("abcdefg")
    edges = random_hierarchy(names, seed=seed).edges
    whole = Hierarchy(names, edges)
    by_rule = {rule: without(whole, sorted(gone), rule) for rule in ("grandparents", "none")}
    for agent in set(range(7)) - gone:
        there = set(whole.senders(agent)) - gone
        assert set(by_rule["grandparents"].senders(agent)) == there
        assert set(by_rule["none"].senders(agent)) <= there
        assert all(not by_rule[rule].senders(one) for one in gone for rule in by_rule)


def test_neighbors_of_who_leaves_are_joined_by_no_rule() -> None:
    line = Hierarchy("abc", [], [("a", "b"), ("b", "c")])
    assert without(line, [1], "grandparents").neighbors == ()


def test_who_is_told_changes_when_agents_leave_and_come_back() -> None:
    chain = Hierarchy("abcd", list(pairwise("abcd")), communication="parents")
    left = LeftAgents(agents="b", episode=1, step=1, end_episode=2)
    messages = Messages(chain, [left], n_actions=4)
    heard = []
    for episode in range(3):
        messages.reset(0, episode)
        for _ in range(2):
            senders, actions, _ = messages.received(2, np.array([3, 1, 0, 2]))
            heard.append((senders.tolist(), actions.tolist()))
            messages.advance(np.zeros(4, dtype=int))
    assert heard == [([1], [1])] * 3 + [([0], [3])] + [([1], [1])] * 2


def carts(failures, learner: dict, n: int = 4) -> tuple[Team, object]:
    world = LineUpSettings(carts=n).build()
    chain = Hierarchy(world.agents, list(pairwise(world.agents)))
    settings = LEARNERS.model(learner["kind"]).model_validate(learner)
    return Team(settings, world, chain, policy_seed(0), failures), world


def test_whoever_has_left_is_neither_asked_nor_considered() -> None:
    left = LeftAgents(agents="cart2", episode=1, action="zero")
    team, world = carts([left], {"kind": "td-lambda", "decision": {"evaluator": {"kind": "exact"}}})
    agents = fuzzy(team)
    costs = []
    for episode in range(2):
        team.reset(0, episode)
        before = agents.counts.joint_actions
        joint = team.act(look(world, world.reset(1)), explore=False).joint_action
        costs.append(agents.counts.joint_actions - before)
    # 4^4 + 4^3 + 4^2 + 4, then a chain of three
    assert costs == [340, 84]
    assert world.action_set.names[joint[1]] == "zero"
    team.reset(0, 0)
    team.act(look(world), explore=False)
    assert agents.search.hierarchy is team.hierarchy


@pytest.mark.parametrize("evaluator", ["exact", "best-response"])
def test_a_team_without_some_decides_as_the_smaller_team(evaluator: str) -> None:
    left = LeftAgents(agents=("cart3", "cart4"))
    learner = {
        "kind": "written",
        "value": {"distance": -1.0, "lead": -0.3},
        "decision": {"evaluator": {"kind": evaluator}},
    }
    team, world = carts([left], learner)
    smaller, two = carts([], learner, 2)
    team.reset(0, 0)
    states = world.reset(3)
    two._places = world._places[:2].copy()
    # Those who have left stay where they are: what is level with them is not what two see.
    world._places[2:] = world._places[:2].mean()
    joint = team.act(look(world, states), explore=False).joint_action
    alone = smaller.act(look(two, states[:2]), explore=False).joint_action
    assert joint[2:].tolist() == [2, 2]
    assert joint[:2].tolist() == alone.tolist()


def test_functions_that_have_left_are_not_called_and_pay_nothing() -> None:
    source = (
        "def decide(observation, received, agent):\n    return {'action': 0, 'message': agent}\n"
    )
    with Sources(texts={"f.py": source}).active():
        left = LeftAgents(agents="cart1", episode=1, repair="next")
        team, world = carts([left], {"kind": "f.py:decide"}, 3)
        spent = []
        for episode in range(2):
            team.reset(0, episode)
            team.act(look(world))
            spent.append((team.decision_costs["calls"], team.decision_costs["messages"]))
    assert spent == [(3, 3), (2, 1)]


def test_functions_that_are_absent_are_not_called_either() -> None:
    source = "def decide(observation):\n    return 0\n"
    with Sources(texts={"f.py": source}).active():
        team, world = carts([AbsentAgents(agents="cart2")], {"kind": "f.py:decide"}, 3)
        team.reset(0, 0)
        assert team.act(look(world)).joint_action.tolist() == [0, 2, 0]
    # cart2 says nothing, and cart3 hears cart1 alone
    assert (team.decision_costs["calls"], team.decision_costs["messages"]) == (2, 1)


def test_an_action_that_there_is_not_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"topology\.failures\[0\]\.action = 'jump': unknown action, a"
    ):
        carts([LeftAgents(agents="cart1", action="jump")], {"kind": "td-lambda"})
