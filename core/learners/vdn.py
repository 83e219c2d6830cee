"""Value decomposition: the sum of the agents' values learns from one error (Sunehag et al. 2018).

What all are paid together says nothing of who earned it. The TD error of the sum goes back to every
agent alike, who learn what their parts must be for the sum to be right.
"""

from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray
from ..plugins.settings import Positive
from .online import OneStepSettings
from .sparse_cooperative import SparseCooperative


class ValueDecompositionSettings(OneStepSettings):
    """The sum of all agents' values learns from the TD error of the team."""

    kind: Literal["vdn"] = "vdn"
    factory: ClassVar[str] = f"{__name__}:ValueDecomposition"
    step_size: Positive = 0.1
    """alpha, divided by the squared length of all agents' feature vectors together."""


class ValueDecomposition(SparseCooperative):
    """TD(0) on the sum of the agents' values, without the networks of the original.

    On entering state s' after state s, with R the reward of all (the sum, if each has its own)::

        delta   = R(s) + gamma sum_i f_i(s') - sum_i f_i(s)
        theta_i = theta_i + alpha delta phi_i(s) / sum_j |phi_j(s)|^2

    The state entered stands for what the agents' greatest values lead to, as in all learners here.
    """

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(self.theta, states, rewards, entered).sum()
        lengths = self.rules.squared_lengths(states).sum()
        return self._step(states, np.full(len(states), delta), lengths)
