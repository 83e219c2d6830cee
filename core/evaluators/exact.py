"""Every joint action of the agents below, or a random sample of them, as suits a team.

Few agents are enumerated, some sampled, and many planned for. Of many agents best responses around
a plan reach greater values than a sample, in half of its time. They are also taken for some, if the
values of others decide too, and wherever there must be a plan.
"""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..numerics import FloatArray, IntArray
from ..rules.kernels.enumeration import Tried
from . import EVALUATORS
from .evaluator import (
    MOST_JOINT_ACTIONS,
    Aggregation,
    DecisionProblem,
    Deliberation,
    Evaluator,
    EvaluatorSettings,
    combinations,
)

TABLES = ("blocks", "reward_table")
"""What predictions have that know what all joint actions lead to."""
Samples = Annotated[int, Field(ge=1, le=1_000_000)]


def probabilities_of(frequencies: FloatArray, below: tuple[int, ...]) -> FloatArray:
    """Return the probability ``(A ** k,)`` of each joint action of the k agents below."""
    probabilities = np.ones(1)
    for agent in below:
        probabilities = np.multiply.outer(probabilities, frequencies[agent]).ravel()
    return probabilities / probabilities.sum()


class ExactEnumeration(Aggregation):
    """Tries every joint action of the agents below, as the paper: ``A ** (1 + len(below))`` each.

    If all agents together try at least as many joint actions as there are, and the prediction has
    tables of all, next states are taken from there; else they are predicted for the joint actions
    that are tried.

    Raises
    ------
    ValueError
        If an agent would have to try more than `MOST_JOINT_ACTIONS`.
    """

    def __init__(self, problem: DecisionProblem) -> None:
        super().__init__(problem)
        n, a = len(self.hierarchy), self.n_actions
        self._below = [combinations(self.hierarchy.below(i), a) for i in range(n)]
        uniform = problem.teammates == "uniform"
        self._expected = np.full((n, a), 1.0 / a) if uniform else np.zeros((0, 0))
        self._tried: list[Tried] = []
        self._means: tuple[tuple[object, ...], FloatArray] | None = None
        if self.hierarchy.joint_actions(a) >= a**n:
            places = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
            self._tried = [self._tried_by(i, places) for i in range(n)]

    def _tried_by(self, agent: int, places: IntArray) -> Tried:
        below = np.array(self.hierarchy.below(agent), dtype=np.int64)
        indices = np.arange(self.n_actions)[:, None] * places[agent]
        indices = indices + (self._below[agent] @ places[below])[None, :]
        given = places.copy()
        given[agent] = given[below] = 0
        return indices, given, below

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent, problem = deliberation.agent, self.problem
        prediction: Any = deliberation.prediction
        conditional = problem.teammates == "conditional"
        own_value = problem.rule == "value" and len(self.concerned[agent]) == 1
        if own_value and not conditional and self._tried and hasattr(prediction, "blocks"):
            tried = self._tried[agent]
            self.count(agent, tried[0].size)
            empirical = problem.teammates == "empirical"
            return self.rules.enumerate(
                deliberation.own_weights,
                prediction.blocks(agent),
                tried,
                deliberation.joint_action,
                deliberation.frequencies if empirical else self._expected,
            )
        below, probabilities = self.hierarchy.below(agent), None
        if problem.teammates == "empirical":
            probabilities = probabilities_of(deliberation.frequencies, below)
        elif conditional:
            probabilities = np.stack([probabilities_of(rows, below) for rows in deliberation.given])
        return self.aggregate(deliberation, self._below[agent], probabilities)

    def worths(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value each own action with each of the joint actions below, from tables if there are."""
        if self._tried and all(hasattr(deliberation.prediction, name) for name in TABLES):
            return self._by_tables(deliberation)
        return super().worths(deliberation, tried)

    def _by_tables(self, deliberation: Deliberation) -> FloatArray:
        """Value ``(A, m)`` each own action with each joint action below, by anything."""
        prediction: Any = deliberation.prediction
        tried, places, _ = self._tried[deliberation.agent]
        concerned = self.concerned[deliberation.agent]
        indices = (tried + int(deliberation.joint_action @ places)).ravel()
        self.count(deliberation.agent, len(indices))
        worth = self.combine(
            lambda: prediction.reward_table()[indices],
            lambda: self._mean(deliberation, concerned)[indices],
        )
        return worth.reshape(self.n_actions, -1)

    def _mean(self, deliberation: Deliberation, concerned: IntArray) -> FloatArray:
        """Return the mean value ``(A ** n,)`` of all joint actions, once for a whole decision."""
        prediction, weights = deliberation.prediction, deliberation.weights
        of = prediction, weights, concerned
        if self._means is None or any(a is not b for a, b in zip(self._means[0], of, strict=True)):
            tables: Any = prediction
            indices = np.arange(self.n_actions ** len(weights))
            values = [
                self.rules.block_values(weights[i], tables.blocks(i), indices) for i in concerned
            ]
            self._means = of, np.mean(values, axis=0)
        return self._means[1]


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
        return self.aggregate(deliberation, tried, probabilities)


class AutoSettings(EvaluatorSettings):
    """Exact enumeration as long as it is quick, then sampling, then best responses."""

    kind: Literal["auto"] = "auto"
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Agents that may still be free for exact enumeration."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Agents that may still be free for sampling, if agents decide by their own value and expect
    best responses."""
    samples: Samples = 64
    """Joint actions that are tried by sampling, as of the evaluator ``sampling``."""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return self.chosen(problem).build(problem)

    def chosen(self, problem: DecisionProblem) -> EvaluatorSettings:
        """Return the settings of the evaluator that a team gets."""
        hierarchy = problem.hierarchy
        if problem.unseen == "plan" or problem.plan == "common":
            return EVALUATORS.parsed("best-response")
        free = max(1 + len(hierarchy.below(i)) for i in range(len(hierarchy)))
        if free <= self.exact_up_to and problem.n_actions ** (free - 1) <= MOST_JOINT_ACTIONS:
            return EVALUATORS.parsed("exact")
        is_large = free > self.sampling_up_to or problem.value_of != "own"
        if is_large and problem.teammates == "best-response":
            return EVALUATORS.parsed("best-response")
        return SamplingSettings(samples=self.samples)
