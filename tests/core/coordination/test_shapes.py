"""Shapes of graphs, other edges in place of theirs, and hierarchies made of them."""

from itertools import combinations

import networkx as nx
import pytest

from nested_agents.core.coordination.graphs import oriented, others, shaped


@pytest.mark.parametrize(
    ("shape", "n", "edges"),
    [("line", 8, 7), ("ring", 8, 8), ("ring", 2, 1), ("tree", 8, 7), ("grid", 8, 10),
     ("grid", 16, 24), ("grid", 7, 6)],
)  # fmt: skip
def test_shapes_have_their_edges_and_are_in_one_piece(shape: str, n: int, edges: int) -> None:
    graph = shaped(shape, n)
    assert (sorted(graph), graph.size(), nx.is_connected(graph)) == ([*range(n)], edges, True)


def test_other_edges_are_as_many_or_all_that_there_are() -> None:
    ring = shaped("ring", 8)
    assert set(others(ring, 1).edges) != set(others(ring, 2).edges)
    for seed in range(5):
        wrong = others(ring, seed)
        assert wrong.size() == 8
        assert not set(wrong.edges) & set(ring.edges)
    assert sorted(others(shaped("ring", 4), 0).edges) == [(0, 2), (1, 3)]


@pytest.mark.parametrize(
    ("shape", "n", "filled"), [("ring", 8, 13), ("line", 8, 7), ("tree", 8, 7)]
)
def test_fill_in_joins_all_who_are_above_one_agent(shape: str, n: int, filled: int) -> None:
    graph = shaped(shape, n)
    plain = oriented(graph, range(n), fill_in=False)
    assert {tuple(sorted(edge)) for edge in plain.edges} == {*map(tuple, map(sorted, graph.edges))}
    moral = oriented(graph, range(n), fill_in=True)
    assert moral.size() == filled
    assert all(a < b for a, b in moral.edges)
    for agent in moral:
        assert all(moral.has_edge(*pair) for pair in combinations(sorted(moral.pred[agent]), 2))


def test_the_order_says_who_is_above_whom() -> None:
    assert sorted(oriented(nx.path_graph(3), [1, 2, 0], fill_in=False).edges) == [(1, 0), (1, 2)]
