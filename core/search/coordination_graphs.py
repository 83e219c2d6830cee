"""Maximization of a sum of tables: exact by variable elimination, approximate by max-plus.

To eliminate an agent, its tables are added and replaced by their maximum over its actions, a table
over its neighbors. When all agents are eliminated, the maximum is known; in reverse order, each
agent takes its best action given those eliminated later. Tables grow to ``A ** (1 + width)``. The
width depends on the order of elimination, which minimizes fill-in (networkx).

Max-plus sends messages between agents and tables in rounds (Kok and Vlassis 2006). Every table
sends each of its agents the value of each action, given the best actions of its other agents and
their messages from other tables. On a tree the messages converge to the exact maximum. On graphs
with loops they may not: the best joint action of all rounds is kept and then improved by best
responses, agent by agent, until no agent gains alone. The cost is linear in the number of tables.

The module also builds undirected graphs over agents and orients them into hierarchies.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import isqrt
from typing import Literal

import numpy as np

from ..numerics import FloatArray, IntArray, nx

Scope = tuple[int, ...]
MAX_ENTRIES = 4**10
"""Maximum number of entries of a table."""


def interaction(scopes: Sequence[Scope], n: int) -> nx.Graph:
    """Return the graph of n agents in which agents with a common scope are joined."""
    graph = nx.empty_graph(n)
    for scope in scopes:
        graph.add_edges_from((a, b) for a in scope for b in scope if a < b)
    return graph


def order_of(graph: nx.Graph) -> tuple[tuple[int, ...], int]:
    """Return an order of elimination that minimizes fill-in heuristically, and its width.

    Examples
    --------
    A line has width 1, a ring has width 2, and four fully joined agents have width 3.

    >>> [order_of(g)[1] for g in (nx.path_graph(5), nx.cycle_graph(5), nx.complete_graph(4))]
    [1, 2, 3]
    """
    width, tree = nx.approximation.treewidth_min_fill_in(graph)
    # Peel the decomposition from its leaves: agents in no other bag can be eliminated.
    order: list[int] = []
    while tree:
        bag = min((bag for bag in tree if tree.degree(bag) <= 1), key=sorted)
        neighbors = set().union(*tree[bag])
        order += sorted(set(bag) - neighbors)
        tree.remove_node(bag)
    return tuple(order), int(width)


class Elimination:
    """Variable elimination in a fixed order.

    Parameters
    ----------
    scopes
        Agents of each table; every agent is in at least one.
    n, n_actions
        Numbers of agents and of actions.

    Raises
    ------
    ValueError
        If the largest table would have more than `MAX_ENTRIES`; before anything is allocated.

    Examples
    --------
    Two agents prefer equal actions, and a third prefers an action other than the second's:

    >>> same, other = np.eye(2), 2.0 * (1.0 - np.eye(2))
    >>> joint = Elimination([(0, 1), (1, 2)], 3, 2).best([same, other + [[0, 0], [1, 0]]])
    >>> joint.tolist()
    [1, 1, 0]
    """

    def __init__(self, scopes: Sequence[Scope], n: int, n_actions: int) -> None:
        self.n_actions = n_actions
        self.order, self.width = order_of(interaction(scopes, n))
        if n_actions ** (1 + self.width) > MAX_ENTRIES:
            raise ValueError(
                f"width {self.width} of the coordination graph takes tables of {n_actions} ** "
                f"{1 + self.width} entries, allowed: {MAX_ENTRIES:,}; use max-plus"
            )
        self._scopes = tuple(scopes)

    def best(self, tables: Sequence[FloatArray]) -> IntArray:
        """Return a joint action ``(n,)`` of the greatest sum; of several, always the same one.

        Parameters
        ----------
        tables
            One for each scope, in their order; not modified.
        """
        known = list(zip(self._scopes, tables, strict=True))
        choices = []
        for agent in self.order:
            mine = [part for part in known if agent in part[0]]
            known = [part for part in known if agent not in part[0]]
            neighbors = tuple(sorted({other for scope, _ in mine for other in scope} - {agent}))
            axes = (*neighbors, agent)
            total: FloatArray = np.zeros(())
            for scope, table in mine:
                # Axes of the table in the common order, of length 1 for other agents.
                shape = [self.n_actions if i in scope else 1 for i in axes]
                places = [scope.index(i) for i in axes if i in scope]
                total = total + table.transpose(places).reshape(shape)
            choices.append((agent, neighbors, total.argmax(axis=-1)))
            known.append((neighbors, total.max(axis=-1)))
        joint = np.zeros(len(choices), dtype=np.int64)
        for agent, neighbors, choice in reversed(choices):
            joint[agent] = choice[tuple(joint[list(neighbors)])]
        return joint


class MaxPlus:
    """Passes messages for a number of rounds.

    Parameters
    ----------
    scopes
        Agents of each table; every agent is in at least one.
    n, n_actions
        Numbers of agents and of actions.
    rounds
        Most rounds; fewer are made if the messages settle.
    damping
        Share of a message that is kept from the round before, 0 to below 1; without loops none is.

    Raises
    ------
    ValueError
        If the largest table has more than `MAX_ENTRIES`; before anything is allocated.

    Examples
    --------
    >>> same, other = np.eye(2), 2.0 * (1.0 - np.eye(2))
    >>> MaxPlus([(0, 1), (1, 2)], 3, 2).best([same, other + [[0, 0], [1, 0]]]).tolist()
    [1, 1, 0]
    """

    def __init__(
        self,
        scopes: Sequence[Scope],
        n: int,
        n_actions: int,
        rounds: int = 100,
        damping: float = 0.5,
    ) -> None:
        self.n = n
        self.n_actions = n_actions
        self.rounds = rounds
        # Tables over the same agents are added up: apart, they would receive their own messages.
        apart = list(dict.fromkeys(scopes))
        self._place = [apart.index(scope) for scope in scopes]
        k = max(map(len, apart))
        if n_actions**k > MAX_ENTRIES:
            raise ValueError(
                f"an agent with {k - 1} neighbors in the coordination graph takes a table of "
                f"{n_actions} ** {k} entries, allowed: {MAX_ENTRIES:,}"
            )
        # Shorter scopes are filled up with an agent that is not there, number n.
        self._members = np.array([(*scope, *[n] * (k - len(scope))) for scope in apart])
        joined = nx.Graph((("table", t), i) for t, scope in enumerate(apart) for i in scope)
        self.damping = 0.0 if nx.is_forest(joined) else damping
        self._of = [np.argwhere(self._members == i) for i in range(n)]

    def best(self, tables: Sequence[FloatArray]) -> IntArray:
        """Return the best joint action ``(n,)`` of all rounds.

        Parameters
        ----------
        tables
            One for each scope, in their order; not modified.
        """
        members = self._members
        a = self.n_actions
        count, k = members.shape
        full = np.zeros((count, *[a] * k))
        for place, table in zip(self._place, tables, strict=True):
            # The same along the axes of agents that are not there.
            full[place] += table[(..., *[None] * (k - table.ndim))]
        to_agents = np.zeros((count, k, a))  # messages of tables
        best = np.zeros(self.n, dtype=np.int64)
        greatest = -np.inf
        for _ in range(self.rounds):
            sums = np.zeros((self.n + 1, a))
            np.add.at(sums, members, to_agents)
            joint = np.append(sums[:-1].argmax(axis=1), 0)
            worth = float(full[(np.arange(count), *joint[members].T)].sum())
            if worth > greatest:
                best = joint[:-1].copy()
                greatest = worth
            to_tables = sums[members] - to_agents  # what agents heard of other tables
            to_tables[members == self.n] = 0.0
            new = self._messages(full, to_tables)
            change = np.abs(new - to_agents).max()
            to_agents = self.damping * to_agents + (1.0 - self.damping) * new
            if change < 1e-9:
                break
        return self._improve(full, best)

    def _messages(self, full: FloatArray, to_tables: FloatArray) -> FloatArray:
        """Return what tables tell their agents ``(tables, k, A)``, with the mean taken away."""
        count, k, a = to_tables.shape
        total = full.copy()
        for p in range(k):
            total += to_tables[:, p].reshape(count, *(a if q == p else 1 for q in range(k)))
        new = np.empty_like(to_tables)
        for p in range(k):
            others = tuple(1 + q for q in range(k) if q != p)
            new[:, p] = total.max(axis=others) - to_tables[:, p]
        return new - new.mean(axis=2, keepdims=True)

    def _improve(self, full: FloatArray, best: IntArray) -> IntArray:
        """Return a joint action that no agent can improve alone."""
        joint = np.append(best, 0)
        gained = True
        while gained:
            gained = False
            for i in range(self.n):
                values = np.zeros(self.n_actions)
                for table, place in self._of[i]:
                    index: list[int | slice] = list(joint[self._members[table]])
                    index[place] = slice(None)
                    values += full[(table, *index)]
                if values.max() > values[joint[i]] + 1e-12 * max(1.0, abs(values.max())):
                    joint[i] = int(values.argmax())
                    gained = True
        return joint[:-1]


Shape = Literal["line", "ring", "tree", "grid"]
"""A path; a cycle; a binary tree; a grid as close to a square as the number of agents allows."""


def build_shape(shape: Shape, n: int) -> nx.Graph:
    """Return a graph of n agents.

    Examples
    --------
    >>> [sorted(build_shape(shape, 4).edges) for shape in ("tree", "grid")]
    [[(0, 1), (0, 2), (1, 3)], [(0, 1), (0, 2), (1, 3), (2, 3)]]
    """
    if shape == "grid":
        rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
        graph = nx.grid_2d_graph(rows, n // rows)
        return nx.convert_node_labels_to_integers(graph, ordering="sorted")
    if shape == "tree":
        return nx.full_rary_tree(2, n)
    return nx.cycle_graph(n) if shape == "ring" and n > 2 else nx.path_graph(n)


def other_edges(graph: nx.Graph, seed: int) -> nx.Graph:
    """Return a random graph with the same number of edges, none of them in `graph`.

    It has fewer edges if too few pairs are free.

    Examples
    --------
    >>> ring = build_shape("ring", 8)
    >>> wrong = other_edges(ring, 0)
    >>> wrong.size(), any(ring.has_edge(*edge) for edge in wrong.edges)
    (8, False)
    """
    free = [pair for pair in combinations(graph, 2) if not graph.has_edge(*pair)]
    drawn = np.random.default_rng(seed).permutation(len(free))[: graph.size()]
    changed = nx.empty_graph(graph)
    changed.add_edges_from(free[k] for k in drawn)
    return changed


def orient(graph: nx.Graph, order: Sequence[str], *, fill_in: bool) -> nx.DiGraph:
    """Return a graph with edges from earlier agents in `order` to later agents.

    With `fill_in`, the superiors of each agent are joined to each other, from the last agent to the
    first. Eliminating an agent makes its best action depend on all of them (Dechter 1999).

    Examples
    --------
    >>> ring = nx.cycle_graph("abcd")
    >>> sorted(orient(ring, "abcd", fill_in=True).edges)
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
