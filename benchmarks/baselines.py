"""What the team's own step is held against: NumPy twice, and plain memory traffic.

*Literal* reads the paper aloud: for every joint action the feature vector phi of 5^7 firing
strengths is built and multiplied with theta; traces and weights are whole-array expressions.
*Factorised* is the NumPy that a careful person writes: theta as a matrix (own rules, shared rules),
contracted by BLAS with the few own feature vectors, so that a joint action costs one inner product
over the shared rules. *Streaming* computes nothing: it reads and writes the bytes that a decision
and an update must move (theta once for the decision; theta and traces, both ways, for the update).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.learners.td import TDLambda
from nested_agents.core.numerics import FloatArray, IntArray

from .situations import Moment

CHUNK = 1
"""Joint actions whose feature vectors are built at once; more are slower, they leave the caches."""


class Baselines:
    """The same decision and update by other means; theta and traces are copies.

    Only for exact enumeration with teammates ``empirical`` or ``uniform`` over a chain, and rule
    bases of one term over all variables.
    """

    def __init__(self, situation: Moment) -> None:
        learner = situation.team.only(FuzzyAgents).learner
        assert isinstance(learner, TDLambda)
        self.situation, self.settings, self.rules = situation, learner.settings, learner.rules
        self.theta = aligned(learner.theta)
        self.trace = aligned(learner.trace)
        n, self.n_actions = len(situation.scenario.agents), len(situation.scenario.action_set)
        self.places = self.n_actions ** np.arange(n - 1, -1, -1)
        self.blocks = [situation.prediction.blocks(i) for i in range(n)]
        counts = [p.size for p in self.rules.partitions]
        self.own_rules = int(np.prod(counts[: self.rules.n_own]))

    def indices(self, agent: int, joint: IntArray) -> IntArray:
        """Return the joint-action indices ``(A ** free,)`` that `agent` tries."""
        free = len(joint) - agent
        return int(joint[:agent] @ self.places[:agent]) + np.arange(self.n_actions**free)

    def decide(self, value_of: str) -> IntArray:
        """Decide greedily down the chain, valuing by `literal` or by `factorised`."""
        joint = np.full(len(self.theta), self.situation.scenario.action_set.neutral)
        self._features: dict[int, FloatArray] = {}
        for i in range(len(joint)):
            values = getattr(self, value_of)(i, self.indices(i, joint))
            joint[i] = int(values.reshape(self.n_actions, -1).mean(axis=1).argmax())
        return joint

    def literal(self, agent: int, indices: IntArray) -> FloatArray:
        """Value joint actions by explicit feature vectors."""
        blocks, theta = self.blocks[agent], self.theta[agent]
        states = blocks.states(indices)
        parts = [
            self.rules.features(states[c : c + CHUNK]) @ theta
            for c in range(0, len(indices), CHUNK)
        ]
        return np.concatenate(parts)

    def factorised(self, agent: int, indices: IntArray) -> FloatArray:
        """Value joint actions by one matrix product per agent and one inner product each."""
        blocks, theta = self.blocks[agent], self.theta[agent].reshape(self.own_rules, -1)
        partial = self._product(blocks.own, 0) @ theta
        key = blocks.divisor
        if key not in self._features:
            self._features[key] = self._product(blocks.shared, self.rules.n_own)
        local = indices // blocks.divisor % len(blocks.own_rows)
        features = self._features[key][blocks.shared_rows[indices]]
        return np.einsum("cs,cs->c", partial[blocks.own_rows[local]], features)

    def _product(self, states: FloatArray, first: int) -> FloatArray:
        product = np.ones((len(states), 1))
        for j in range(states.shape[1]):
            strengths = self.rules.partitions[first + j].strengths(states[:, j])
            product = (product[:, :, None] * strengths[:, None, :]).reshape(len(states), -1)
        return product

    def update(self) -> None:
        """Make one TD update by whole-array expressions (Eq. 7, 12, 13)."""
        before, after = self.situation.states
        phi = self.rules.features(before)
        gamma, decay = self.settings.discount, self.settings.trace_decay
        f = np.einsum("ij,ij->i", phi, self.theta)
        ahead = np.einsum("ij,ij->i", self.rules.features(after), self.theta)
        delta = float(self.situation.rewards[0]) + gamma * ahead - f
        self.trace *= gamma * decay
        self.trace += phi
        self.theta += (self.settings.step_size * delta)[:, None] * self.trace

    def literal_step(self) -> None:
        """Decide and learn by the book."""
        self.decide("literal")
        self.update()

    def factorised_step(self) -> None:
        """Decide by matrix products and learn."""
        self.decide("factorised")
        self.update()

    def streaming_step(self) -> None:
        """Move the bytes of a decision and an update."""
        self.read = float(_read(self.theta.ravel()))
        _write(self.theta.ravel(), self.trace.ravel(), 1.0e-9, 0.38)


def aligned(like: FloatArray) -> FloatArray:
    """Return a copy that begins on a cache line."""
    room = np.empty(like.nbytes + 64, dtype=np.uint8)
    start = -room.ctypes.data % 64
    copy = room[start : start + like.nbytes].view(like.dtype).reshape(like.shape)
    copy[:] = like
    return copy


@njit(cache=True, fastmath=True)
def _read(theta):  # type: ignore[no-untyped-def]
    total = theta[0]
    for k in range(len(theta)):
        total += theta[k]
    return total


@njit(cache=True, fastmath=True)
def _write(theta, trace, step, decay):  # type: ignore[no-untyped-def]
    step, decay = theta.dtype.type(step), theta.dtype.type(decay)
    for k in range(len(theta)):
        e = decay * trace[k]
        trace[k] = e
        theta[k] += step * e
