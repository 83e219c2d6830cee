"""The agents by body: what they are expected to do, as probabilities of robot actions."""

from __future__ import annotations

import numpy as np

from ..interface.hierarchy import Hierarchy
from ..numerics.arrays import FloatArray, IntArray
from .evaluator import Teammates


class Grouping:
    """Groups of agents that move one body each, and a hierarchy over the agents.

    Attributes
    ----------
    of, place
        ``(n,)`` group of every agent, and its place within.
    actions
        Per group the actions ``(A ** w, w)`` of its agents by index.

    Examples
    --------
    Of two groups of one agent, agent 0 is to choose and 1 below it does anything:

    >>> grouping = Grouping(((0,), (1,)), Hierarchy("ab", [("a", "b")]), 2, "uniform")
    >>> grouping.expected(0, np.zeros(2, dtype=int), np.zeros((0, 0)))
    array([[1. , 1. ],
           [0.5, 0.5]])
    """

    def __init__(
        self,
        groups: tuple[tuple[int, ...], ...],
        hierarchy: Hierarchy,
        n_actions: int,
        teammates: Teammates,
    ) -> None:
        self.n_actions, self.teammates = n_actions, teammates
        self.of = [g for g, group in enumerate(groups) for _ in group]
        self.place = [place for group in groups for place in range(len(group))]
        # Groups of one size at a time: which they are, and their members (groups, size).
        self._sizes = []
        for w in sorted({len(group) for group in groups}):
            which = [g for g, group in enumerate(groups) if len(group) == w]
            self._sizes.append((np.array(which), np.array([groups[g] for g in which])))
        tables = {w: np.indices((n_actions,) * w).reshape(w, -1).T for w in map(len, groups)}
        self.actions: list[IntArray] = [tables[len(group)] for group in groups]
        n_local = np.array([len(actions) for actions in self.actions])
        self._shape = len(groups), int(n_local.max())
        self._below = [np.array(hierarchy.below(i), dtype=int) for i in range(len(hierarchy))]

    def expected(self, agent: int, joint_action: IntArray, frequencies: FloatArray) -> FloatArray:
        """Return probabilities ``(G, L)`` of robot actions as `agent` expects them.

        The actions above it are given, the agents below are independent; its own actions have
        weight one each. The parameters are those of a `Deliberation`.
        """
        n, a = len(joint_action), self.n_actions
        probabilities: FloatArray = np.zeros((n, a))
        probabilities[np.arange(n), joint_action] = 1.0
        below = self._below[agent]
        probabilities[below] = frequencies[below] if self.teammates == "empirical" else 1.0 / a
        probabilities[agent] = 1.0
        expected = np.zeros(self._shape)
        for which, members in self._sizes:
            joint = probabilities[members[:, 0]]
            for column in members.T[1:]:
                joint = (joint[:, :, None] * probabilities[column][:, None, :]).reshape(
                    len(which), -1
                )
            expected[which, : joint.shape[1]] = joint
        return expected

    def by_action(
        self, agent: int, local: IntArray, weights: FloatArray, values: FloatArray
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent` over what its partners may do.

        Parameters
        ----------
        agent
            The deciding agent.
        local
            ``(m,)`` possible robot actions of its group.
        weights, values
            ``(m,)`` probabilities of the partners' actions in each, and what it is worth.
        """
        own = self.actions[self.of[agent]][local, self.place[agent]]
        if self.teammates == "best-response":
            best = np.full(self.n_actions, -np.inf)
            np.maximum.at(best, own, values)
            return best
        total = np.bincount(own, weights * values, self.n_actions)
        return total / np.bincount(own, weights, self.n_actions)
