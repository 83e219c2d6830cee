"""Every joint action of the agents below."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray, IntArray
from ..protocols import Prediction
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
                    f"decision.evaluator: agent {name!r} would try {a} ** {free} joint actions, "
                    f"exact enumeration allows {MOST_JOINT_ACTIONS}; use sampling"
                )
        self._prediction: Prediction | None = None
        self._strengths: dict[int, tuple[FloatArray, FloatArray]] = {}
        self._tried = [combinations(self.hierarchy.below(i), a) for i in range(n)]
        self._tabulated = self.hierarchy.joint_actions(a) >= a**n
        if not self._tabulated:
            return
        self._places = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
        self._fixed_places = np.tile(self._places, (n, 1))  # of the actions that are given
        for i in range(n):
            self._fixed_places[i, [i, *self.hierarchy.below(i)]] = 0
        # Code offsets (A, A ** k): own action by joint action of the agents below.
        self._offsets = [
            np.arange(a)[:, None] * self._places[i]
            + (self._tried[i] @ self._places[list(self.hierarchy.below(i))])[None, :]
            for i in range(n)
        ]

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
        below, tried = self.hierarchy.below(agent), self._tried[agent]
        if self.indifferent(theta):
            self.count(self.n_actions * len(tried))
            return np.zeros(self.n_actions)
        weights = weights_of(frequencies, below) if self.others == "observed" else None
        if self._tabulated:
            table = self._by_codes(agent, joint_action, theta, prediction)
        else:
            table = self.by_states(agent, joint_action, tried, theta, prediction)
        return self.gather(table, weights)

    def _by_codes(
        self, agent: int, joint_action: IntArray, theta: FloatArray, prediction: Prediction
    ) -> FloatArray:
        codes = (self._offsets[agent] + int(joint_action @ self._fixed_places[agent])).ravel()
        self.count(len(codes))
        rewards = values = None
        if self.rule != "value":
            rewards = prediction.reward_table()[codes]
        if self.rule != "reward":
            blocks = prediction.blocks(agent)
            strengths = self._strengths_of(prediction, blocks.shared)
            values = self.rules.block_values(theta, blocks, codes, strengths)
        return self.combine(rewards, values).reshape(self.n_actions, -1)

    def _strengths_of(self, prediction: Prediction, shared: FloatArray) -> FloatArray:
        """Return the strengths of a shared block, found once for all agents that have it."""
        if prediction is not self._prediction:
            self._prediction = prediction
            self._strengths.clear()
        if id(shared) not in self._strengths:
            self._strengths[id(shared)] = shared, self.rules.shared_strengths(shared)
        return self._strengths[id(shared)][1]
