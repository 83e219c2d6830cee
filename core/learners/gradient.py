"""Gradient temporal-difference learning: TDC(lambda) and GTD2(lambda), which always converge.

The paper cites them as [26]. Beside theta every agent keeps a second weight vector w, an estimate
of the expected TD error given the features, learned with its own step size beta.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.settings import Fraction, Positive
from ..rules.kernels.updates import add_features, td_update
from ..rules.rule_base import RuleBase
from .learner import LearnerSettings
from .online import Online


class GradientTDSettings(LearnerSettings):
    """Gradient TD(lambda), the convergent method cited as [26]."""

    kind: Literal["gradient-td"] = "gradient-td"
    factory: ClassVar[str] = f"{__name__}:GradientTD"
    correction: Literal["tdc", "gtd2"] = "tdc"
    """TD with gradient correction, or GTD2."""
    step_size: Positive = 0.01
    """Step size of the consequent weights, alpha."""
    second_step_size: Positive = 0.005
    """Step size of the second weights, beta."""
    trace_decay: Fraction = 0.4
    """Trace decay, lambda."""


class GradientTD(Online):
    """TDC(lambda) or GTD2(lambda) (Maei 2011, ch. 5; Geist and Scherrer 2014, Eq. 20 and 21).

    On entering state s' after state s, with phi = phi(s), phi' = phi(s')::

        delta = R(s) + gamma f(s') - f(s)
        e     = gamma lambda e + phi
        TDC:    theta += alpha (delta e - gamma (1 - lambda) (e'w) phi')
        GTD2:   theta += alpha ((phi'w) phi - gamma (1 - lambda) (e'w) phi')
        w     += beta (delta e - (phi'w) phi)

    where ``x'w`` is an inner product; after a terminal state there are no next features.
    """

    kept = ("theta", "second", "trace", "reach")

    def __init__(self, settings: GradientTDSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings.discount, rules, rows)
        self.settings = settings
        self.second: FloatArray = np.zeros_like(self.theta)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        s, rules, rows = self.settings, self.rules, self.rows
        delta = self.errors(self.theta, states, rewards, entered)
        expected = rules.each(self.of_agents(self.second), states[:, None])[:, 0]
        along = s.step_size * delta if s.correction == "tdc" else np.zeros_like(delta)
        td_update(
            self.theta, rows, self.trace, self.reach, states, along, s.discount * s.trace_decay,
            rules.layout,
        )  # fmt: skip
        if s.correction == "gtd2":
            add_features(self.theta, rows, states, s.step_size * expected, rules.layout)
        if entered is not None:
            carried = np.einsum("ij,ij->i", self.trace, self.of_agents(self.second))
            weight = -s.step_size * s.discount * (1.0 - s.trace_decay) * carried
            add_features(self.theta, rows, entered, weight, rules.layout)
        np.add.at(self.second, rows, (s.second_step_size * delta)[:, None] * self.trace)
        change = -s.second_step_size * expected
        add_features(self.second, rows, states, change, rules.layout)
        return 2 * self.theta.size
