"""Variable elimination: the exact maximum of a sum of tables, agent by agent.

To eliminate an agent, the tables that it takes part in are added, and replaced by their maximum
over its actions, a table over its neighbours. When all are eliminated the maximum is known; going
back, each agent takes its best action given those that were eliminated later. The tables grow to
``A ** (1 + width)``; the width depends on the order, which is that of least fill-in (networkx).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.deferred import nx

Scope = tuple[int, ...]


def interaction(scopes: Sequence[Scope], n: int) -> nx.Graph:
    """Return the graph of n agents in which those that share a scope are joined."""
    graph = nx.Graph()
    graph.add_nodes_from(range(n))
    for scope in scopes:
        graph.add_edges_from((a, b) for a in scope for b in scope if a < b)
    return graph


def order_of(graph: nx.Graph) -> tuple[tuple[int, ...], int]:
    """Return an order of elimination, by the heuristic of least fill-in, and its width.

    Examples
    --------
    A line has width 1, a ring 2, and of four agents who are all joined, three are left at first.

    >>> [order_of(g)[1] for g in (nx.path_graph(5), nx.cycle_graph(5), nx.complete_graph(4))]
    [1, 2, 3]
    """
    width, tree = nx.approximation.treewidth_min_fill_in(graph)
    # Peel the decomposition from its leaves: what is in no other bag can be eliminated.
    order: list[int] = []
    while tree:
        bag = min((bag for bag in tree if tree.degree(bag) <= 1), key=sorted)
        beside = set().union(*tree[bag])
        order += sorted(set(bag) - beside)
        tree.remove_node(bag)
    return tuple(order), int(width)


class _Step(NamedTuple):
    """The elimination of one agent."""

    agent: int
    parts: tuple[tuple[int, tuple[int, ...], tuple[int, ...]], ...]
    """Tables that it takes part in: number, order of axes, shape among the agents concerned."""
    beside: tuple[int, ...]
    """The others concerned: axes of the table that is left, its own axis was the last."""


class Elimination:
    """Eliminates agents in an order that is found once.

    Parameters
    ----------
    scopes
        Of the tables; every agent is in one at least.
    n, n_actions
        Agents and actions.

    Raises
    ------
    ValueError
        If the largest table would have more than `most_entries`; before anything is allocated.

    Examples
    --------
    Two agents who like to do the same, and one who dislikes what the second does:

    >>> same, other = np.eye(2), 2.0 * (1.0 - np.eye(2))
    >>> joint = Elimination([(0, 1), (1, 2)], 3, 2).best([same, other + [[0, 0], [1, 0]]])
    >>> joint.tolist()
    [1, 1, 0]
    """

    def __init__(
        self, scopes: Sequence[Scope], n: int, n_actions: int, most_entries: int = 4**10
    ) -> None:
        self.n_actions = n_actions
        self.order, self.width = order_of(interaction(scopes, n))
        if n_actions ** (1 + self.width) > most_entries:
            raise ValueError(
                f"width {self.width} of the coordination graph takes tables of {n_actions} ** "
                f"{1 + self.width} entries, allowed: {most_entries:,}; use max-plus"
            )
        self._n_scopes = len(scopes)
        self._steps = tuple(self._planned(scopes))

    def _planned(self, scopes: Sequence[Scope]) -> list[_Step]:
        known: dict[int, Scope] = dict(enumerate(scopes))
        steps = []
        for agent in self.order:
            mine = [k for k, scope in known.items() if agent in scope]
            beside = tuple(sorted({a for k in mine for a in known[k]} - {agent}))
            axes = (*beside, agent)
            parts = []
            for k in mine:
                # A table's axes in the order of the concerned, 1 where it has none.
                shape = tuple(self.n_actions if a in known[k] else 1 for a in axes)
                places = tuple(known[k].index(a) for a in axes if a in known[k])
                parts.append((k, places, shape))
                del known[k]
            steps.append(_Step(agent, tuple(parts), beside))
            known[len(scopes) + len(steps) - 1] = beside
        return steps

    def best(self, tables: Sequence[FloatArray]) -> IntArray:
        """Return a joint action ``(n,)`` of the greatest sum; of several, always the same one.

        Parameters
        ----------
        tables
            One for each scope, in their order; not modified.
        """
        known = dict(enumerate(tables))
        choices = []
        for number, step in enumerate(self._steps):
            total: FloatArray = np.zeros(())
            for k, places, shape in step.parts:
                total = total + known.pop(k).transpose(places).reshape(shape)
            choices.append(total.argmax(axis=-1))
            known[self._n_scopes + number] = total.max(axis=-1)
        joint = np.zeros(len(self._steps), dtype=np.int64)
        for step, choice in zip(reversed(self._steps), reversed(choices), strict=True):
            joint[step.agent] = choice[tuple(joint[list(step.beside)])]
        return joint
