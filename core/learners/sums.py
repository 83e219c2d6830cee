"""Online learners of a sum: the values of agents add up to that of the team.

In sparse cooperative Q-learning each agent learns its part of the sum over its neighbors in a
coordination graph; a common reward is divided equally (Kok and Vlassis 2006). In value
decomposition the sum learns from one error: the TD error of the sum updates every agent (Sunehag
et al. 2018).
"""

from typing import ClassVar, Literal

import numpy as np

from ..numerics import FloatArray
from ..plugins.settings import Positive
from .td import OneStep, OneStepSettings


class SparseCooperativeSettings(OneStepSettings):
    """Sparse cooperative Q-learning: agents learn the parts of a sum."""

    kind: Literal["sparse-cooperative"] = "sparse-cooperative"
    factory: ClassVar[str] = f"{__name__}:SparseCooperative"


class SparseCooperative(OneStep):
    """TD(0) for each part of a sum (Kok and Vlassis 2006, Eq. 11, on after-states).

    On entering state s' after state s, agent i of n learns::

        delta_i = R_i(s) + gamma f_i(s') - f_i(s)
        theta_i = theta_i + alpha delta_i phi_i(s) / |phi_i(s)|^2

    where R_i is its own reward, or R / n for a common reward: the deltas then add up to the TD
    error of ``sum_i f_i``. The state entered replaces the best next state, which the greedy joint
    action of the graph leads to.
    """

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these, each agent by its share."""
        n_deciding = max(len(states) - len(self.idle), 1)
        shared = reward / n_deciding if np.ndim(reward) == 0 else reward
        return super().observe(states, shared, terminated)


class ValueDecompositionSettings(OneStepSettings):
    """Value decomposition: the sum of all values learns from the TD error of the team."""

    kind: Literal["vdn"] = "vdn"
    factory: ClassVar[str] = f"{__name__}:ValueDecomposition"
    step_size: Positive = 0.1
    """Step size, divided by the squared length of all agents' feature vectors together."""


class ValueDecomposition(SparseCooperative):
    """TD(0) on the sum of the agents' values, without the networks of the original.

    On entering state s' after state s, with R the reward of all (the sum, if each has its own)::

        delta   = R(s) + gamma sum_i f_i(s') - sum_i f_i(s)
        theta_i = theta_i + alpha delta phi_i(s) / sum_j |phi_j(s)|^2

    The state entered replaces the best next state, as in all learners here.
    """

    def _errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        errors = super()._errors(states, rewards, entered)
        errors[self.idle] = 0.0
        return np.full(len(states), errors.sum())

    def _lengths(self, states: FloatArray) -> FloatArray:
        return np.delete(super()._lengths(states), self.idle).sum()
