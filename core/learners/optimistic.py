"""Optimistic TD: what went wrong is put down to the others, who still explore.

An agent that does not see what the others do cannot tell a bad action from a good one that they
spoilt. Lauer and Riedmiller (2000) let values rise only; Matignon, Laurent and Le Fort-Piat (2007)
let them fall, more slowly than they rise.
"""

from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray
from ..plugins.settings import Fraction
from .online import OneStep, OneStepSettings


class OptimisticTDSettings(OneStepSettings):
    """TD(0) whose values rise faster than they fall, for agents that do not see one another."""

    kind: Literal["optimistic-td"] = "optimistic-td"
    factory: ClassVar[str] = f"{__name__}:OptimisticTD"
    falling: Fraction = 0.0
    """Step size of negative TD errors over alpha: 0 never lowers a value (distributed Q-learning),
    in between is hysteretic, 1 is TD(0)."""


class OptimisticTD(OneStep):
    """TD(0) that believes good news more than bad.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)                       (Eq. 7)
        theta = theta + alpha max(delta, b delta) phi(s) / |phi(s)|^2

    with b the setting `falling`.
    """

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(self.theta, states, rewards, entered)
        return self._step(states, np.maximum(delta, self.settings.falling * delta))
