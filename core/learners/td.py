"""Online TD(lambda) with accumulating traces (Eq. 7-13)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .. import kernels
from ..arrays import FloatArray
from ..config import TDLambdaSettings
from ..rules import RuleBase


class TDLambda:
    """The paper's learner: one update of all agents per step.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)          (Eq. 7)
        e     = gamma lambda e + phi(s)            (Eq. 8, 12)
        theta = theta + alpha delta e              (Eq. 13)

    With a normalised step size alpha is divided by the squared length of phi(s), so that
    ``step_size = 1`` would remove the TD error of s at once.

    A terminal state s' is followed by itself for ever, which adds one update with
    ``delta = R(s') / (1 - gamma) - f(s')``.
    """

    candidates = 0

    def __init__(self, settings: TDLambdaSettings, rules: RuleBase, n_agents: int) -> None:
        self.settings, self.rules = settings, rules
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules), rules.dtype)
        self.trace: FloatArray = np.zeros_like(self.theta)
        self.reach: FloatArray = np.zeros((n_agents, rules.n_rows))
        self._previous: FloatArray | None = None
        self._reward = 0.0

    def begin_episode(self) -> None:
        """Clear the traces."""
        self.trace[:], self.reach[:] = 0.0, 0.0
        self._previous = None

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
        """Update by Eq. 7-13 for the step from the previous states to these."""
        gamma, changed = self.settings.discount, 0
        if self._previous is not None:
            changed += self._update(
                self._previous, self._reward + gamma * self.rules.each(self.theta, states)
            )
        self._previous, self._reward = states.copy(), reward
        if terminated:
            changed += self._update(states, np.full(len(states), reward / (1.0 - gamma)))
        return changed

    def end_episode(self) -> int:
        """Nothing is left to learn."""
        return 0

    def _update(self, states: FloatArray, targets: FloatArray) -> int:
        delta = targets - self.rules.each(self.theta, states)
        steps = self.settings.step_size * delta
        if self.settings.normalised:
            steps = steps / self.rules.squared_lengths(states)
        decay = self.settings.discount * self.settings.trace_decay
        kernels.td_update(
            self.theta, self.trace, self.reach, states, steps, decay, self.rules.layout
        )
        return self.theta.size

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, traces and the previous states with their reward."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        return {
            "theta": self.theta,
            "trace": self.trace,
            "reach": self.reach,
            "previous": previous,
            "reward": np.array(self._reward),
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta, self.trace = arrays["theta"].copy(), arrays["trace"].copy()
        self.reach = arrays["reach"].copy()
        self._previous = arrays["previous"].copy() if arrays["previous"].size else None
        self._reward = float(arrays["reward"])
