"""A random sample of the joint actions of the agents below."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..numerics.arrays import FloatArray
from .evaluator import (
    Aggregation,
    DecisionProblem,
    Deliberation,
    EvaluatorSettings,
    combinations,
    probabilities_of,
)

Samples = Annotated[int, Field(ge=1, le=1_000_000)]


class SamplingSettings(EvaluatorSettings):
    """Try a random sample of the joint actions of the agents below."""

    kind: Literal["sampling"] = "sampling"
    factory: ClassVar[str] = f"{__name__}:Sampling"
    samples: Samples = 64
    """Joint actions of the agents below that are tried with each own action."""


class Sampling(Aggregation):
    """Tries a random sample of the joint actions below, the same ones for every own action.

    Drawn with equal probability, or from the empirical frequencies if these are the teammate model
    (then the plain mean estimates the weighted one). With no more joint actions than samples, all
    are tried.

    Raises
    ------
    ValueError
        If the teammate model is conditional on the own action.
    """

    def __init__(self, settings: SamplingSettings, problem: DecisionProblem) -> None:
        super().__init__(problem)
        if problem.teammates == "conditional":
            raise ValueError(
                "learner.decision.teammates = 'conditional': sampling evaluates best-response, "
                "uniform, empirical; use exact"
            )
        self.samples = settings.samples

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        below, a = self.hierarchy.below(deliberation.agent), self.n_actions
        frequencies, rng = deliberation.frequencies, deliberation.rng
        empirical = self.problem.teammates == "empirical"
        probabilities = None
        if a ** len(below) <= self.samples:
            tried = combinations(below, a)
            if empirical:
                probabilities = probabilities_of(frequencies, below)
        elif empirical:
            ladder = frequencies[list(below)].cumsum(axis=1)[:, :-1]
            draws = rng.random((self.samples, len(below), 1))
            tried = (draws >= ladder).sum(axis=2)
        else:
            tried = rng.integers(a, size=(self.samples, len(below)))
        if self.indifferent(deliberation):
            self.count(deliberation.agent, a * len(tried))
            return np.zeros(a)
        return self.aggregate(self.by_states(deliberation, tried), probabilities)
