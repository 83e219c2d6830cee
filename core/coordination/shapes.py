"""Shapes of undirected graphs over agents in their order, and what makes hierarchies of graphs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import isqrt
from typing import Literal

import numpy as np

from ..plugins.deferred import nx

Shape = Literal["line", "ring", "tree", "grid"]
"""A line; the same, closed; every agent joined with the next two that are free; rows and columns,
as nearly a square as the number of agents allows."""


def shaped(shape: Shape, n: int) -> nx.Graph:
    """Return a graph of n agents.

    Examples
    --------
    >>> [sorted(shaped(shape, 4).edges) for shape in ("tree", "grid")]
    [[(0, 1), (0, 2), (1, 3)], [(0, 1), (0, 2), (1, 3), (2, 3)]]
    """
    if shape == "grid":
        rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
        graph = nx.grid_2d_graph(rows, n // rows)
        return nx.relabel_nodes(graph, {node: k for k, node in enumerate(sorted(graph))})
    if shape == "tree":
        return nx.full_rary_tree(2, n)
    return nx.cycle_graph(n) if shape == "ring" and n > 2 else nx.path_graph(n)


def others(graph: nx.Graph, seed: int) -> nx.Graph:
    """Return a graph of as many edges, if there are so many, none of them one of `graph`.

    Examples
    --------
    >>> ring = shaped("ring", 8)
    >>> wrong = others(ring, 0)
    >>> wrong.size(), any(ring.has_edge(*edge) for edge in wrong.edges)
    (8, False)
    """
    free = [pair for pair in combinations(graph, 2) if not graph.has_edge(*pair)]
    drawn = np.random.default_rng(seed).permutation(len(free))[: graph.size()]
    changed = nx.empty_graph(graph)
    changed.add_edges_from(free[k] for k in drawn)
    return changed


def oriented(graph: nx.Graph, order: Sequence[str], *, fill_in: bool) -> nx.DiGraph:
    """Return a graph whose edges lead from whom comes first in `order` to whom comes later.

    With `fill_in`, those who are above an agent are joined, too, from the last agent to the first:
    eliminating it makes the best that it can do depend on all of them together (Dechter 1999).

    Examples
    --------
    >>> ring = nx.cycle_graph("abcd")
    >>> sorted(oriented(ring, "abcd", fill_in=True).edges)
    [('a', 'b'), ('a', 'c'), ('a', 'd'), ('b', 'c'), ('c', 'd')]
    """
    place = {agent: k for k, agent in enumerate(order)}
    joined = nx.Graph(graph)
    for agent in reversed(order) if fill_in else ():
        above = sorted((a for a in joined[agent] if place[a] < place[agent]), key=place.__getitem__)
        joined.add_edges_from(combinations(above, 2))
    directed = nx.empty_graph(order, create_using=nx.DiGraph)
    directed.add_edges_from(sorted(edge, key=place.__getitem__) for edge in joined.edges)
    return directed
