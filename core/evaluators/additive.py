"""Evaluators for many agents: the agents below enter through the sum of what their groups do.

Both need a prediction that can be had to first order, its ``superposition``, and value by f alone.
Their cost per agent is linear in the number of groups. The own group is enumerated; for the other
groups

- `Moments` (teammates uniform or empirical) takes the sum as a random variable, of which mean and
  covariance suffice: f is averaged over sigma points (Julier and Uhlmann 2004) that have the same.
- `Extremes` (teammates best response) takes the greatest f over the mean sum and the sums that lie
  farthest out in one of 26 directions (k = 3): in a given direction every group's best is
  independent of the others, so that these joint actions are found without search.

A superposition of ``G`` groups, of ``L`` robot-action indices at most, that share ``k`` components
has

- ``contributions`` ``(G, L, k)``: what each index of each group adds to the sum;
- ``alike`` ``(G, L)``: the first index of the group that comes to the same;
- ``states(agent, local, sums, shares)``: the next states ``(m, d)`` of an agent, given the indices
  ``(m,)`` of its own group, the contributions ``(m, k)`` of all groups added up, and the
  probabilities ``(G, L)`` of the indices of the other groups.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from itertools import product
from typing import Any, Literal

import numpy as np

from ..numerics.arrays import FloatArray
from .evaluator import Aggregation, DecisionProblem, Deliberation, EvaluatorSettings, Teammates
from .grouping import Grouping


class MomentsSettings(EvaluatorSettings):
    """Average over the agents below by mean and covariance of what their groups contribute."""

    kind: Literal["moments"] = "moments"

    def build(self, problem: DecisionProblem) -> Moments:
        """Return the evaluator of a team."""
        return Moments(problem)


class ExtremesSettings(EvaluatorSettings):
    """Take the best for the deciding agent among extreme sums of what the groups contribute."""

    kind: Literal["extremes"] = "extremes"

    def build(self, problem: DecisionProblem) -> Extremes:
        """Return the evaluator of a team."""
        return Extremes(problem)


class _Additive(Aggregation, ABC):
    """What the two share: the own group is enumerated.

    Raises
    ------
    ValueError
        If the scenario predicts no sums, predicted rewards or values of others are asked for, or
        the teammate model is not one of the evaluator's.
    """

    name: str
    allowed: tuple[Teammates, ...]

    def __init__(self, problem: DecisionProblem) -> None:
        super().__init__(problem)
        if not problem.additive:
            raise ValueError(
                f"learner.decision.evaluator = {self.name!r}: the scenario predicts no sums, "
                "use exact or sampling"
            )
        if problem.rule != "value":
            raise ValueError(
                f"learner.decision.rule = {problem.rule!r}: {self.name} evaluates 'value' only"
            )
        if problem.value_of != "own":
            raise ValueError(
                f"learner.decision.value_of = {problem.value_of!r}: {self.name} evaluates 'own' "
                "only, use best-response"
            )
        if problem.teammates not in self.allowed:
            raise ValueError(
                f"learner.decision.teammates = {problem.teammates!r}: {self.name} evaluates "
                f"{', '.join(self.allowed)}"
            )
        self._grouping = Grouping(
            problem.groups, problem.hierarchy, problem.n_actions, problem.teammates
        )

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = deliberation.agent
        prediction: Any = deliberation.prediction
        superposition = prediction.superposition
        expected = self._grouping.expected(
            agent, deliberation.joint_action, deliberation.frequencies
        )
        mine = self._grouping.of[agent]
        weights = expected[mine].copy()  # of the partners' actions, given each own action
        expected[mine] = 0.0
        local = np.flatnonzero(weights)
        # Actions of the group that come to the same are valued once.
        distinct, which = np.unique(superposition.alike[mine, local], return_inverse=True)
        sums, probabilities = self._sums(superposition.contributions, expected)
        reached = superposition.contributions[mine, distinct][:, None] + sums
        states = superposition.states(
            agent, np.repeat(distinct, len(sums)), reached.reshape(-1, sums.shape[1]), expected
        )
        found = self.rules.values(deliberation.own_weights, states).reshape(len(distinct), -1)
        self.count(agent, found.size)
        valued = self._over_sums(found, probabilities)[which]
        return self._grouping.by_action(agent, local, weights[local], valued)

    @abstractmethod
    def _sums(
        self, contributions: FloatArray, expected: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return sums ``(s, k)`` over the other groups, and their probabilities ``(s,)``."""

    @abstractmethod
    def _over_sums(self, values: FloatArray, probabilities: FloatArray) -> FloatArray:
        """Aggregate values ``(robot actions, s)`` over the sums."""


class Moments(_Additive):
    """Averages over the agents below by the mean and covariance of their contributions."""

    name = "moments"
    allowed = ("uniform", "empirical")

    def _sums(
        self, contributions: FloatArray, expected: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        k = contributions.shape[2]
        weighted = expected[:, :, None] * contributions
        means = weighted.sum(axis=1)
        # Groups act independently: covariances add up.
        squares = weighted.reshape(-1, k).T @ contributions.reshape(-1, k)
        return sigma_points(means.sum(axis=0), squares - means.T @ means)

    def _over_sums(self, values: FloatArray, probabilities: FloatArray) -> FloatArray:
        return values @ probabilities


CENTRE = 0.25
"""Weight of the mean among the sigma points."""


def sigma_points(mean: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points ``(2 k + 1, k)`` and weights of given mean and covariance.

    The mean, and two points at equal distance from it along each principal axis.

    Examples
    --------
    >>> points, weights = sigma_points(np.array([1.0]), np.array([[4.0]]))
    >>> float(weights @ points[:, 0]), round(float(weights @ (points[:, 0] - 1) ** 2), 9)
    (1.0, 4.0)
    """
    k = len(mean)
    variances, axes = np.linalg.eigh(covariance)
    arms = axes * np.sqrt(np.maximum(variances, 0.0) * k / (1.0 - CENTRE))
    points = np.concatenate([mean[None], mean + arms.T, mean - arms.T])
    return points, np.array([CENTRE] + [(1.0 - CENTRE) / (2 * k)] * (2 * k))


class Extremes(_Additive):
    """Takes the best for the deciding agent among extreme sums of the agents below."""

    name = "extremes"
    allowed = ("best-response",)
    _scored: FloatArray | None = None
    _scores: FloatArray

    def _sums(
        self, contributions: FloatArray, expected: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        possible = expected > 0.0
        if contributions is not self._scored:  # the same for all agents of a step
            scale = np.abs(contributions).max(axis=(0, 1)) + 1e-12
            self._scored = contributions
            self._scores = (contributions / scale) @ directions(len(scale)).T
        best = np.where(possible[:, :, None], self._scores, -np.inf).argmax(axis=1)
        groups = np.flatnonzero(possible.any(axis=1))
        chosen = contributions[groups[:, None], best[groups]].sum(axis=0)
        mean = (expected[:, :, None] * contributions).sum(axis=(0, 1))
        return np.concatenate([mean[None], chosen]), np.zeros(0)

    def _over_sums(self, values: FloatArray, probabilities: FloatArray) -> FloatArray:
        return values.max(axis=1)


@cache
def directions(k: int) -> FloatArray:
    """Return the directions ``(3 ** k - 1, k)`` to the corners, edges and faces of a cube."""
    every = np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))
    lengths = np.linalg.norm(every, axis=1)
    return every[lengths > 0] / lengths[lengths > 0, None]
