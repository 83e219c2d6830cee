"""Elimination and max-plus against brute force on random graphs.

Shapes of graphs, other edges in place of theirs, and hierarchies made of them.
"""

from itertools import combinations

import networkx as nx
import numpy as np
import pytest

from nested_agents.core.search.coordination_graphs import (
    Elimination,
    MaxPlus,
    build_shape,
    interaction,
    order_of,
    orient,
    other_edges,
)


def total(scopes, tables, joint):
    return float(sum(t[tuple(joint[list(scope)])] for scope, t in zip(scopes, tables, strict=True)))


def pairwise(graph):
    """Scopes of a graph's edges and agents."""
    return [tuple(sorted(edge)) for edge in graph.edges] + [(i,) for i in graph]


def tables(scopes, rng, actions=4):
    return [rng.random((actions,) * len(scope)) for scope in scopes]


def brute_force(scopes, tables, n, actions=4):
    every = np.indices((actions,) * n).reshape(n, -1)
    return sum(t[tuple(every[list(s)])] for s, t in zip(scopes, tables, strict=True)).max()


def test_elimination_is_exact_on_500_random_graphs():
    rng = np.random.default_rng(0)
    for _ in range(500):
        n, actions = int(rng.integers(2, 8)), int(rng.integers(2, 5))
        graph = nx.gnp_random_graph(n, rng.uniform(0.1, 1.0), seed=int(rng.integers(2**31)))
        scopes = pairwise(graph)
        scopes += [tuple(sorted(rng.choice(n, size=min(n, 3), replace=False).tolist()))]
        values = [rng.normal(size=(actions,) * len(scope)) for scope in scopes]
        joint = Elimination(scopes, n, actions).best(values)
        best = brute_force(scopes, values, n, actions)
        assert total(scopes, values, joint) == pytest.approx(best, abs=1e-9)


def test_the_order_has_the_width_that_is_told():
    for seed in range(20):
        graph = nx.gnp_random_graph(12, 0.3, seed=seed)
        order, width = order_of(graph)
        assert sorted(order) == list(range(12))
        left, widest = graph.copy(), 0
        for agent in order:
            neighbors = set(left[agent])
            widest = max(widest, len(neighbors))
            left.remove_node(agent)
            left.add_edges_from((a, b) for a in neighbors for b in neighbors if a < b)
        assert widest <= width


def test_max_plus_is_exact_on_trees():
    rng = np.random.default_rng(1)
    for seed in range(30):
        tree = nx.random_labeled_tree(8, seed=seed)
        scopes = pairwise(tree)
        values = tables(scopes, rng)
        found = total(scopes, values, MaxPlus(scopes, 8, 4).best(values))
        best = total(scopes, values, Elimination(scopes, 8, 4).best(values))
        assert found == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize(("degree", "n"), [(2, 16), (3, 8), (3, 16), (3, 24)])
def test_max_plus_comes_near_the_optimum(degree, n):
    rng, shares = np.random.default_rng(n), []
    for seed in range(12):
        scopes = pairwise(nx.random_regular_graph(degree, n, seed=seed))
        values = tables(scopes, rng)
        found = total(scopes, values, MaxPlus(scopes, n, 4).best(values))
        best = total(scopes, values, Elimination(scopes, n, 4).best(values))
        assert found <= best + 1e-9
        shares.append(found / best)
    assert np.mean(shares) >= 0.99


def test_more_rounds_are_never_worse():
    rng = np.random.default_rng(3)
    scopes = pairwise(nx.complete_graph(7))
    for _ in range(5):
        values = [rng.normal(size=(4,) * len(scope)) for scope in scopes]
        found = [
            total(scopes, values, MaxPlus(scopes, 7, 4, rounds=rounds).best(values))
            for rounds in (1, 100)
        ]
        assert found[1] >= found[0] - 1e-9


def test_what_is_too_wide_is_refused_before_anything_is_allocated():
    scopes = pairwise(nx.complete_graph(40))
    with pytest.raises(ValueError, match=r"width 39 of the coordination graph takes tables of 4"):
        Elimination(scopes, 40, 4)
    with pytest.raises(ValueError, match="an agent with 39 neighbors"):
        MaxPlus([tuple(range(40))], 40, 4)


def test_scopes_join_their_agents():
    graph = interaction([(0, 1, 2), (3,)], 4)
    assert sorted(graph.edges) == [(0, 1), (0, 2), (1, 2)]


@pytest.mark.parametrize(
    ("shape", "n", "edges"),
    [("line", 8, 7), ("ring", 8, 8), ("ring", 2, 1), ("tree", 8, 7), ("grid", 8, 10),
     ("grid", 16, 24), ("grid", 7, 6)],
)  # fmt: skip
def test_shapes_have_their_edges_and_are_in_one_piece(shape: str, n: int, edges: int) -> None:
    graph = build_shape(shape, n)
    assert (sorted(graph), graph.size(), nx.is_connected(graph)) == ([*range(n)], edges, True)


def test_other_edges_are_as_many_or_all_that_there_are() -> None:
    ring = build_shape("ring", 8)
    assert set(other_edges(ring, 1).edges) != set(other_edges(ring, 2).edges)
    for seed in range(5):
        wrong = other_edges(ring, seed)
        assert wrong.size() == 8
        assert not set(wrong.edges) & set(ring.edges)
    assert sorted(other_edges(build_shape("ring", 4), 0).edges) == [(0, 2), (1, 3)]


@pytest.mark.parametrize(
    ("shape", "n", "filled"), [("ring", 8, 13), ("line", 8, 7), ("tree", 8, 7)]
)
def test_fill_in_joins_all_who_are_above_one_agent(shape: str, n: int, filled: int) -> None:
    graph = build_shape(shape, n)
    plain = orient(graph, range(n), fill_in=False)
    assert {tuple(sorted(edge)) for edge in plain.edges} == {*map(tuple, map(sorted, graph.edges))}
    moral = orient(graph, range(n), fill_in=True)
    assert moral.size() == filled
    assert all(a < b for a, b in moral.edges)
    for agent in moral:
        assert all(moral.has_edge(*pair) for pair in combinations(sorted(moral.pred[agent]), 2))


def test_the_order_says_who_is_above_whom() -> None:
    assert sorted(orient(nx.path_graph(3), [1, 2, 0], fill_in=False).edges) == [(1, 0), (1, 2)]
