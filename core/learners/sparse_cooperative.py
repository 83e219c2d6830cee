"""Sparse cooperative Q-learning: each agent learns its part of a sum (Kok and Vlassis 2006).

The team's value is the sum of the agents' values, each over its neighbours in a coordination graph.
What all are paid together is shared out equally, so that the parts add up to it.
"""

from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray
from .online import OneStep, OneStepSettings


class SparseCooperativeSettings(OneStepSettings):
    """Agents learn the parts of a sum, each by its share of the reward."""

    kind: Literal["sparse-cooperative"] = "sparse-cooperative"
    factory: ClassVar[str] = f"{__name__}:SparseCooperative"


class SparseCooperative(OneStep):
    """TD(0) for each part of a sum (Kok and Vlassis 2006, Eq. 11, on after-states).

    On entering state s' after state s, agent i of n learns::

        delta_i = R_i(s) + gamma f_i(s') - f_i(s)
        theta_i = theta_i + alpha delta_i phi_i(s) / |phi_i(s)|^2

    where R_i is its own reward, or R / n if one is paid to all: then the deltas add up to the TD
    error of ``sum_i f_i``. The state entered stands for the best one, which is what the greedy
    joint action of the graph leads to.
    """

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these, each agent by its share."""
        shared = reward / len(states) if np.ndim(reward) == 0 else reward
        return super().observe(states, shared, terminated)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return self._step(states, self.errors(self.theta, states, rewards, entered))
