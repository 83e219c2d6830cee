"""The agents by body: what they are expected to do, as probabilities of local codes."""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray
from ..hierarchy import Hierarchy
from .evaluator import Others


class Grouping:
    """Groups of agents that move one body each, and a hierarchy over the agents.

    Attributes
    ----------
    groups
        The agents of every group.
    of, place
        ``(n,)`` group of every agent, and its place within.
    actions
        Per group the actions ``(A ** w, w)`` of its agents by local code.
    valid
        ``(G, L)`` which local codes each group has; L is of the largest.

    Examples
    --------
    Of two groups of one agent, agent 0 is to choose and 1 below it does anything:

    >>> grouping = Grouping(((0,), (1,)), Hierarchy("ab", [("a", "b")]), 2, "mean")
    >>> grouping.shares(0, np.zeros(2, dtype=int), np.zeros((0, 0)))
    array([[1. , 1. ],
           [0.5, 0.5]])
    """

    def __init__(
        self,
        groups: tuple[tuple[int, ...], ...],
        hierarchy: Hierarchy,
        n_actions: int,
        others: Others,
    ) -> None:
        self.groups, self.n_actions, self.others = groups, n_actions, others
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
        self.valid: BoolArray = np.arange(n_local.max()) < n_local[:, None]
        self._below = [np.array(hierarchy.below(i), dtype=int) for i in range(len(hierarchy))]

    def shares(self, agent: int, joint_action: IntArray, frequencies: FloatArray) -> FloatArray:
        """Return probabilities ``(G, L)`` of local codes as `agent` expects them.

        The actions above it are given, the agents below are independent; its own actions have
        weight one each. The parameters are those of `Evaluator.values`.
        """
        n, a = len(joint_action), self.n_actions
        chances: FloatArray = np.zeros((n, a))
        chances[np.arange(n), joint_action] = 1.0
        below = self._below[agent]
        chances[below] = frequencies[below] if self.others == "observed" else 1.0 / a
        chances[agent] = 1.0
        shares = np.zeros(self.valid.shape)
        for which, members in self._sizes:
            joint = chances[members[:, 0]]
            for column in members.T[1:]:
                joint = (joint[:, :, None] * chances[column][:, None, :]).reshape(len(which), -1)
            shares[which, : joint.shape[1]] = joint
        return shares

    def by_action(
        self, agent: int, local: IntArray, weights: FloatArray, values: FloatArray
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent` over what its partners may do.

        Parameters
        ----------
        agent
            The deciding agent.
        local
            ``(m,)`` possible local codes of its group.
        weights, values
            ``(m,)`` probabilities of the partners' actions in each, and what it is worth.
        """
        own = self.actions[self.of[agent]][local, self.place[agent]]
        if self.others == "max":
            best = np.full(self.n_actions, -np.inf)
            np.maximum.at(best, own, values)
            return best
        total = np.bincount(own, weights * values, self.n_actions)
        return total / np.bincount(own, weights, self.n_actions)

    def joint_actions(self, codes: IntArray) -> IntArray:
        """Return the joint actions ``(m, n)`` of local codes ``(m, G)`` of all groups."""
        joint = np.empty((len(codes), len(self.of)), dtype=np.int64)
        for which, members in self._sizes:
            joint[:, members] = self.actions[which[0]][codes[:, which]]
        return joint
