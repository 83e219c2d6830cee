"""Gradient temporal-difference learning: TDC(lambda) and GTD2(lambda), which always converge.

The paper cites them as [26]. Beside theta every agent keeps a second weight vector w, an estimate
of the expected TD error given the features, learned with its own step size beta.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .. import kernels
from ..arrays import FloatArray
from ..config import GradientTDSettings
from ..rules import RuleBase


class GradientTD:
    """TDC(lambda) or GTD2(lambda) (Maei 2011, ch. 5; Geist and Scherrer 2014, Eq. 20 and 21).

    On entering state s' after state s, with phi = phi(s), phi' = phi(s')::

        delta = R(s) + gamma f(s') - f(s)
        e     = gamma lambda e + phi
        TDC:    theta += alpha (delta e - gamma (1 - lambda) (e'w) phi')
        GTD2:   theta += alpha ((phi'w) phi - gamma (1 - lambda) (e'w) phi')
        w     += beta (delta e - (phi'w) phi)

    where ``x'w`` is an inner product. A terminal state is followed by itself, as in
    `nested_agents.core.learners.td.TDLambda`, in a last update without next features.
    """

    candidates = 0

    def __init__(self, settings: GradientTDSettings, rules: RuleBase, n_agents: int) -> None:
        self.settings, self.rules = settings, rules
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules), rules.dtype)
        self.second: FloatArray = np.zeros_like(self.theta)
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
        """Update for the step from the previous states to these."""
        changed = 0
        if self._previous is not None:
            changed += self._update(self._previous, self._reward, states)
        self._previous, self._reward = states.copy(), reward
        if terminated:
            changed += self._update(states, reward / (1.0 - self.settings.discount), None)
        return changed

    def _update(self, states: FloatArray, reward: float, entered: FloatArray | None) -> int:
        s, rules = self.settings, self.rules
        delta = reward - rules.each(self.theta, states)
        if entered is not None:
            delta += s.discount * rules.each(self.theta, entered)
        expected = rules.each(self.second, states)
        along = s.step_size * delta if s.correction == "tdc" else np.zeros_like(delta)
        kernels.td_update(
            self.theta, self.trace, self.reach, states, along, s.discount * s.trace_decay,
            rules.layout,
        )  # fmt: skip
        if s.correction == "gtd2":
            kernels.add_features(self.theta, states, s.step_size * expected, rules.layout)
        if entered is not None:
            carried = np.einsum("ij,ij->i", self.trace, self.second)
            weight = -s.step_size * s.discount * (1.0 - s.trace_decay) * carried
            kernels.add_features(self.theta, entered, weight, rules.layout)
        self.second += (s.second_step_size * delta)[:, None] * self.trace
        kernels.add_features(self.second, states, -s.second_step_size * expected, rules.layout)
        return 2 * self.theta.size

    def end_episode(self) -> int:
        """Nothing is left to learn."""
        return 0

    def arrays(self) -> dict[str, FloatArray]:
        """Return both weight vectors, traces and the previous states with their reward."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        return {
            "theta": self.theta,
            "second": self.second,
            "trace": self.trace,
            "reach": self.reach,
            "previous": previous,
            "reward": np.array(self._reward),
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta, self.second = arrays["theta"].copy(), arrays["second"].copy()
        self.trace, self.reach = arrays["trace"].copy(), arrays["reach"].copy()
        self._previous = arrays["previous"].copy() if arrays["previous"].size else None
        self._reward = float(arrays["reward"])
