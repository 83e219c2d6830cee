"""FMQ: actions that have paid best, and often, are worth more than their mean.

The frequency of the maximum reward tells an action that pays well if the others do their part from
one that was lucky (Kapetanakis and Kudenko 2002).
"""

from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.settings import NonNegative
from ..rules.rule_base import RuleBase
from .online import OneStep, OneStepSettings


class FMQSettings(OneStepSettings):
    """Frequency maximum Q-value, for agents that do not see one another."""

    kind: Literal["fmq"] = "fmq"
    factory: ClassVar[str] = f"{__name__}:FMQ"
    weight: NonNegative = 10.0
    """c: how much the frequency of the maximum reward counts."""


class FMQ(OneStep):
    """TD(0) with a bonus for rules under which the greatest reward came often.

    ``weights`` learn as in TD(0). Of the rule k that fires most in the state left, a table keeps
    the greatest reward R_max(k), and how often it came, F(k), as a fraction of visits. Agents
    decide by::

        theta_k = weights_k + c F(k) R_max(k)

    With membership functions at the actions of a game this is the published heuristic; between
    membership functions it is an approximation.
    """

    kept = ("theta", "weights", "greatest", "hits", "visits", "trace", "reach")

    def __init__(self, settings: FMQSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.weights = np.zeros_like(self.theta)
        shape = self.theta.shape
        self.greatest: FloatArray = np.full(shape, -np.inf)
        self.hits: FloatArray = np.zeros(shape)
        self.visits: FloatArray = np.zeros(shape)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        self._step(states, self.errors(self.weights, states, rewards, entered))
        active, strengths = self.rules.active(states)
        fired = active[np.arange(len(states)), strengths.argmax(axis=1)]
        for row, rule, reward in zip(self.rows, fired, rewards, strict=True):
            self.visits[row, rule] += 1.0
            if reward > self.greatest[row, rule]:
                self.greatest[row, rule], self.hits[row, rule] = reward, 0.0
            self.hits[row, rule] += reward == self.greatest[row, rule]
        self.theta[:] = self.weights
        seen = self.visits > 0.0
        bonus = self.settings.weight * self.hits[seen] / self.visits[seen] * self.greatest[seen]
        self.theta[seen] += bonus
        return 2 * self.theta.size
