"""A random sample of the joint actions of the agents below."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray, IntArray
from ..protocols import Prediction
from .evaluator import Gathering, combinations, weights_of


class Sampling(Gathering):
    """Tries a random sample of the joint actions below, the same ones for every own action.

    Drawn with equal chance, or from the observed frequencies if others are "observed" (then the
    plain mean estimates the weighted one). With no more joint actions than samples, all are tried.
    """

    def __init__(self, samples: int, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.samples = samples

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
        below, a = self.hierarchy.below(agent), self.n_actions
        weights = None
        if a ** len(below) <= self.samples:
            tried = combinations(below, a)
            if self.others == "observed":
                weights = weights_of(frequencies, below)
        elif self.others == "observed":
            ladder = frequencies[list(below)].cumsum(axis=1)[:, :-1]
            draws = rng.random((self.samples, len(below), 1))
            tried = (draws >= ladder).sum(axis=2)
        else:
            tried = rng.integers(a, size=(self.samples, len(below)))
        if self.indifferent(theta):
            self.count(a * len(tried))
            return np.zeros(a)
        table = self.by_states(agent, joint_action, tried, theta, prediction)
        return self.gather(table, weights)
