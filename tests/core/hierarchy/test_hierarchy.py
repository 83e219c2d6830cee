"""Senders, searched and unseen agents of hierarchies; refused graphs."""

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.core.hierarchy.hierarchy import Hierarchy

CHAIN = Hierarchy("abcd", [("a", "b"), ("b", "c"), ("c", "d")])
TREE = Hierarchy("abcde", [("a", "b"), ("a", "c"), ("b", "d"), ("b", "e")])
DIAMOND = Hierarchy("abcd", [("a", "b"), ("a", "c"), ("b", "d"), ("c", "d")])
APART = Hierarchy("abc", [])


@st.composite
def hierarchies(draw: st.DrawFn) -> Hierarchy:
    n = draw(st.integers(1, 7))
    names = [f"agent{i}" for i in range(n)]
    rank = draw(st.permutations(range(n)))
    pairs = [(i, j) for i in range(n) for j in range(n) if rank[i] < rank[j]]
    edges = [pair for pair in pairs if draw(st.booleans())]
    return Hierarchy(names, [(names[i], names[j]) for i, j in edges])


def test_a_chain() -> None:
    assert CHAIN.order == (0, 1, 2, 3)
    assert [CHAIN.searched(i) for i in range(4)] == [(1, 2, 3), (2, 3), (3,), ()]
    assert [CHAIN.senders(i) for i in range(4)] == [(), (0,), (0, 1), (0, 1, 2)]
    assert [CHAIN.unseen(i) for i in range(4)] == [(), (), (), ()]
    assert (len(CHAIN), CHAIN.depth) == (4, 4)
    assert repr(CHAIN) == "Hierarchy(4 agents: a -> b, b -> c, c -> d)"


def test_a_tree() -> None:
    assert TREE.order == (0, 1, 2, 3, 4)
    assert (TREE.searched(0), TREE.searched(1), TREE.searched(2)) == ((1, 2, 3, 4), (3, 4), ())
    assert (TREE.senders(3), TREE.unseen(3)) == ((0, 1), (2, 4))
    assert (TREE.unseen(2), TREE.depth) == ((1, 3, 4), 3)


def test_a_diamond_counts_nobody_twice() -> None:
    assert DIAMOND.searched(0) == (1, 2, 3)
    assert DIAMOND.senders(3) == (0, 1, 2)
    assert DIAMOND.unseen(1) == (2,)


def test_independent_agents_see_nobody() -> None:
    assert [APART.unseen(i) for i in range(3)] == [(1, 2), (0, 2), (0, 1)]
    assert (APART.order, APART.depth, repr(APART)) == (
        (0, 1, 2),
        1,
        "Hierarchy(3 agents: no edges)",
    )


def test_ties_are_decided_in_agent_order() -> None:
    # d and b are roots; b comes first, then its subordinate a before the other root d.
    assert Hierarchy("abcd", [("b", "a"), ("d", "c")]).order == (1, 0, 3, 2)


def test_joint_actions_of_a_chain_are_the_papers_sum() -> None:
    # 4 ** 4 + 4 ** 3 + 4 ** 2 + 4 for four wheels; exact far beyond 64 bits.
    assert CHAIN.count_joint_actions(4) == 256 + 64 + 16 + 4
    assert APART.count_joint_actions(4) == 12
    names = [str(i) for i in range(100)]
    long = Hierarchy(names, list(pairwise(names)))
    assert long.count_joint_actions(4) == (4**101 - 4) // 3


@given(hierarchies())
def test_everybody_else_is_above_below_or_unseen(hierarchy: Hierarchy) -> None:
    n = len(hierarchy)
    assert sorted(hierarchy.order) == list(range(n))
    position = {agent: k for k, agent in enumerate(hierarchy.order)}
    for i in range(n):
        classes = [*hierarchy.senders(i), *hierarchy.searched(i), *hierarchy.unseen(i), i]
        assert sorted(classes) == list(range(n))
        assert all(i in hierarchy.senders(j) for j in hierarchy.searched(i))
        assert all(position[j] < position[i] for j in hierarchy.senders(i))
        assert all(i in hierarchy.unseen(j) for j in hierarchy.unseen(i))


@given(hierarchies(), st.data())
def test_permuting_agents_permutes_the_hierarchy(
    permuted: Any, hierarchy: Hierarchy, data: st.DataObject
) -> None:
    n = len(hierarchy)
    permutation = data.draw(st.permutations(range(n)))
    other = permuted(hierarchy, permutation)
    for k, i in enumerate(permutation):
        assert other.agents[k] == hierarchy.agents[i]
        assert {permutation[j] for j in other.searched(k)} == set(hierarchy.searched(i))
        assert {permutation[j] for j in other.senders(k)} == set(hierarchy.senders(i))
    assert other.count_joint_actions(4) == hierarchy.count_joint_actions(4)
    assert other.depth == hierarchy.depth


@pytest.mark.parametrize(
    ("agents", "edges", "complaint"),
    [
        ("", [], "hierarchy: no agents"),
        ("aba", [], "agent 'a' is named more than once"),
        ("ab", [("a", "z")], "edge a -> z names unknown agent 'z', known: a, b"),
        ("ab", [("z", "a")], "edge z -> a names unknown agent 'z', known: a, b"),
        ("ab", [("a", "a")], "agent 'a' cannot be its own superior"),
        ("ab", [("a", "b"), ("a", "b")], "edge a -> b is given more than once"),
        ("ab", [("a", "b"), ("b", "a")], "cycle a -> b -> a"),
        ("abcd", [("a", "b"), ("b", "c"), ("c", "d"), ("d", "b")], "cycle b -> c -> d -> b"),
    ],
)
def test_a_hierarchy_refuses(agents: str, edges: list, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        Hierarchy(agents, edges)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("communication", "senders"), [("ancestors", (0, 1, 2)), ("parents", (2,)), ("none", ())]
)
@pytest.mark.parametrize(
    ("lookahead", "searched"), [("descendants", (1, 2, 3)), ("children", (1,)), ("none", ())]
)
def test_communication_and_lookahead_are_switched_separately(
    communication, senders, lookahead, searched
) -> None:
    parted = Hierarchy("abcd", [("a", "b"), ("b", "c"), ("c", "d")], (), communication, lookahead)
    assert (parted.senders(3), parted.searched(0)) == (senders, searched)
    assert parted.order == CHAIN.order
    assert parted.unseen(3) == tuple(i for i in range(3) if i not in senders)
    assert parted.n_messages == {"ancestors": 6, "parents": 3, "none": 0}[communication]


@pytest.mark.parametrize(
    ("some", "above", "below", "messages"),
    [
        (("body",), (4,), (3,), 4),
        (("next",), (2, 3), (4, 5), 12),
        (("farther",), (0, 1), (6, 7), 12),
        (("body", "farther"), (0, 1, 4), (3, 6, 7), 16),
    ],
)
def test_edges_are_left_out_by_where_they_lead(some, above, below, messages) -> None:
    names, bodies = "abcdefgh", ["ab", "cd", "ef", "gh"]
    parted = Hierarchy(names, list(pairwise(names)), (), some, some, bodies)
    assert (parted.senders(5), parted.searched(2)) == (above, below)
    assert parted.n_messages == messages


def test_neighbors_need_lookahead() -> None:
    with pytest.raises(ValueError, match="lookahead = 'none': neighbors search over"):
        Hierarchy("ab", [], [("a", "b")], lookahead="none")
    assert Hierarchy("ab", [], [("a", "b")]).n_messages == 2
    assert Hierarchy("ab", [], [("a", "b")], communication="none").n_messages == 0


def test_edges_may_be_lists_as_json_has_them() -> None:
    assert Hierarchy(["a", "b"], [["a", "b"]]).edges == ((0, 1),)
    with pytest.raises(ValueError, match="more than once"):
        Hierarchy(["a", "b"], [["a", "b"], ("a", "b")])
