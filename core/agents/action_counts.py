"""Counts of the actions of all agents, from which agents predict their teammates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..interface.agents import StateDict
from ..numerics import AnyArray, FloatArray, IntArray
from ..search.evaluator import NO_AGENTS, NOTHING_GIVEN


class ActionCounts:
    """Counts of actions, initially one for every action.

    Parameters
    ----------
    n, n_actions
        Numbers of agents, and of actions of each.
    is_conditional
        Whether to count also given each action of another agent.

    Attributes
    ----------
    totals
        ``(n, A)`` counts of the actions of every agent.
    conditional
        ``(n, A, n, A)`` counts given each action of another agent, or empty.

    Examples
    --------
    >>> counts = ActionCounts(2, 2, is_conditional=False)
    >>> counts.add(np.array([0, 1]))
    >>> counts.totals.tolist()
    [[2.0, 1.0], [1.0, 2.0]]
    """

    def __init__(self, n: int, n_actions: int, *, is_conditional: bool) -> None:
        self.totals: FloatArray = np.ones((n, n_actions))
        shape = (n, n_actions) * 2 if is_conditional else (0, 0, 0, 0)
        self.conditional: FloatArray = np.ones(shape)

    @property
    def frequencies(self) -> FloatArray:
        """``(n, A)`` relative frequencies of the actions of every agent."""
        return self.totals / self.totals.sum(axis=1, keepdims=True)

    def frequencies_given(self, agent: int) -> FloatArray:
        """Return relative frequencies ``(A, n, A)`` given each action of an agent, or nothing."""
        if not self.conditional.size:
            return NOTHING_GIVEN
        return self.conditional[agent] / self.conditional[agent].sum(axis=2, keepdims=True)

    def add(self, joint_action: IntArray, left: IntArray = NO_AGENTS) -> None:
        """Count a joint action ``(n,)``, without the agents ``(k,)`` that have left."""
        agents = np.delete(np.arange(len(joint_action)), left)
        taken = joint_action[agents]
        self.totals[agents, taken] += 1.0
        if self.conditional.size:
            self.conditional[agents[:, None], taken[:, None], agents, taken] += 1.0

    def warm_start(self, former: ActionCounts, alike: Sequence[tuple[int, IntArray]]) -> None:
        """Start from counts of another team.

        Conditional counts continue if the number of agents is the same.

        Parameters
        ----------
        former
            Counts of the other team.
        alike
            Agents of this team, each with the agents ``(k,)`` of the other team that it resembles.
        """
        for agent, others in alike:
            self.totals[agent] = former.totals[others].mean(axis=0)
        if self.conditional.shape == former.conditional.shape:
            self.conditional = former.conditional.copy()

    def state_dict(self) -> StateDict:
        """Return the saved state."""
        return {"seen": self.totals} | (
            {"given": self.conditional} if self.conditional.size else {}
        )

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`."""
        self.totals = state["seen"].copy()
        if self.conditional.size:
            self.conditional = state["given"].copy()
