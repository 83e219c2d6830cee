"""Every joint action of the agents below."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray, IntArray
from ..protocols import Prediction
from ..rules.kernels import Tried
from .evaluator import Gathering, combinations, weights_of

MOST_JOINT_ACTIONS = 4**12
"""The most that one agent enumerates: beyond, the tables do not fit into memory."""


class ExactEnumeration(Gathering):
    """Tries every joint action of the agents below: ``A ** (1 + len(below))`` per agent.

    If all agents together try at least as many joint actions as there are, next states are taken
    from a table of all, else they are predicted for the joint actions that are tried.

    Raises
    ------
    ValueError
        If an agent would have to try more than `MOST_JOINT_ACTIONS`.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        n, a = len(self.hierarchy), self.n_actions
        for i, name in enumerate(self.hierarchy.agents):
            free = 1 + len(self.hierarchy.below(i))
            if a**free > MOST_JOINT_ACTIONS:
                raise ValueError(
                    f"learner.decision.evaluator: agent {name!r} would try {a} ** {free} joint "
                    f"actions, exact enumeration allows {MOST_JOINT_ACTIONS}; use sampling"
                )
        self._below = [combinations(self.hierarchy.below(i), a) for i in range(n)]
        self._tabulated = self.hierarchy.joint_actions(a) >= a**n
        self._chances = np.full((n, a), 1.0 / a) if self.others == "mean" else np.zeros((0, 0))
        if self._tabulated:
            places = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
            self._tried = [self._tried_by(i, places) for i in range(n)]

    def _tried_by(self, agent: int, places: IntArray) -> Tried:
        below = np.array(self.hierarchy.below(agent), dtype=np.int64)
        codes = np.arange(self.n_actions)[:, None] * places[agent]
        codes = codes + (self._below[agent] @ places[below])[None, :]
        given = places.copy()
        given[agent] = given[below] = 0
        return Tried(codes, given, below)

    def values(
        self,
        agent: int,
        joint_action: IntArray,
        theta: FloatArray,
        prediction: Prediction,
        frequencies: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent`, see `Evaluator.values`."""
        if self._tabulated and self.rule == "value":
            tried = self._tried[agent]
            self.count(tried.codes.size)
            return self.rules.enumerate(
                theta, prediction.blocks(agent), tried, joint_action,
                frequencies if self.others == "observed" else self._chances,
            )  # fmt: skip
        below, combined = self.hierarchy.below(agent), self._below[agent]
        if self.indifferent(theta):
            self.count(self.n_actions * len(combined))
            return np.zeros(self.n_actions)
        weights = weights_of(frequencies, below) if self.others == "observed" else None
        if self._tabulated:
            table = self._by_codes(agent, joint_action, theta, prediction)
        else:
            table = self.by_states(agent, joint_action, combined, theta, prediction)
        return self.gather(table, weights)

    def _by_codes(
        self, agent: int, joint_action: IntArray, theta: FloatArray, prediction: Prediction
    ) -> FloatArray:
        tried = self._tried[agent]
        codes = (tried.codes + int(joint_action @ tried.places)).ravel()
        self.count(len(codes))
        rewards, values = prediction.reward_table()[codes], None
        if self.rule != "reward":
            values = self.rules.block_values(theta, prediction.blocks(agent), codes)
        return self.combine(rewards, values).reshape(self.n_actions, -1)
