"""Evaluators for many agents: the agents below enter through the sum of what their groups do.

Both need a prediction that can be had to first order (`nested_agents.core.protocols.Superposition`)
and value by f alone. Their cost per agent is linear in the number of groups. The own group is
enumerated; for the other groups

- `Moments` (others "mean" or "observed") takes the sum as a random variable, of which mean and
  covariance suffice: f is averaged over sigma points (Julier and Uhlmann 2004) that have the same.
- `Extremes` (others "max") takes the greatest f over the mean sum and the sums that lie farthest
  out in one of 26 directions (k = 3): in a given direction every group's best is independent of the
  others, so that these joint actions are found without search.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from itertools import product
from typing import cast

import numpy as np

from ..arrays import FloatArray, IntArray
from ..hierarchy import Hierarchy
from ..protocols import Prediction, SummedPrediction
from ..rules.rule_base import RuleBase
from .evaluator import Gathering, Others, Rule
from .grouping import Grouping


class _Summed(Gathering, ABC):
    """What the two share: the own group is enumerated.

    Raises
    ------
    ValueError
        If predicted rewards are asked for, or `others` is not one of the evaluator's.
    """

    name: str
    allowed: tuple[Others, ...]

    def __init__(
        self,
        groups: tuple[tuple[int, ...], ...],
        rules: RuleBase,
        hierarchy: Hierarchy,
        n_actions: int,
        rule: Rule,
        others: Others,
        discount: float,
    ) -> None:
        super().__init__(rules, hierarchy, n_actions, rule, others, discount)
        if rule != "value":
            raise ValueError(
                f"learner.decision.rule = {rule!r}: {self.name} evaluates 'value' only"
            )
        if others not in self.allowed:
            raise ValueError(
                f"learner.decision.others = {others!r}: {self.name} evaluates "
                f"{', '.join(self.allowed)}"
            )
        self._grouping = Grouping(groups, hierarchy, n_actions, others)

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
        superposition = cast(SummedPrediction, prediction).superposition
        shares = self._grouping.shares(agent, joint_action, frequencies)
        mine = self._grouping.of[agent]
        weights = shares[mine].copy()  # of the partners' actions, given each own action
        shares[mine] = 0.0
        local = np.flatnonzero(weights)
        # Local codes that come to the same are valued once.
        distinct, which = np.unique(superposition.alike[mine, local], return_inverse=True)
        sums, chance = self._sums(superposition.contributions, shares)
        reached = superposition.contributions[mine, distinct][:, None] + sums
        states = superposition.states(
            agent, np.repeat(distinct, len(sums)), reached.reshape(-1, sums.shape[1]), shares
        )
        found = self.rules.values(theta, states).reshape(len(distinct), -1)
        self.count(found.size)
        valued = self._over_sums(found, chance)[which]
        return self._grouping.by_action(agent, local, weights[local], valued)

    @abstractmethod
    def _sums(self, contributions: FloatArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return sums ``(s, k)`` over the other groups, and their chances ``(s,)``."""

    @abstractmethod
    def _over_sums(self, values: FloatArray, chance: FloatArray) -> FloatArray:
        """Gather values ``(local codes, s)`` over the sums."""


class Moments(_Summed):
    """Averages over the agents below by the mean and covariance of their contributions."""

    name = "moments"
    allowed = ("mean", "observed")

    def _sums(self, contributions: FloatArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = contributions.shape[2]
        weighted = shares[:, :, None] * contributions
        means = weighted.sum(axis=1)
        # Groups act independently: covariances add up.
        squares = weighted.reshape(-1, k).T @ contributions.reshape(-1, k)
        return sigma_points(means.sum(axis=0), squares - means.T @ means)

    def _over_sums(self, values: FloatArray, chance: FloatArray) -> FloatArray:
        return values @ chance


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


class Extremes(_Summed):
    """Takes the best for the deciding agent among extreme sums of the agents below."""

    name = "extremes"
    allowed = ("max",)
    _scored: FloatArray | None = None
    _scores: FloatArray

    def _sums(self, contributions: FloatArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        possible = shares > 0.0
        if contributions is not self._scored:  # the same for all agents of a step
            scale = np.abs(contributions).max(axis=(0, 1)) + 1e-12
            self._scored = contributions
            self._scores = (contributions / scale) @ directions(len(scale)).T
        best = np.where(possible[:, :, None], self._scores, -np.inf).argmax(axis=1)
        groups = np.flatnonzero(possible.any(axis=1))
        chosen = contributions[groups[:, None], best[groups]].sum(axis=0)
        mean = (shares[:, :, None] * contributions).sum(axis=(0, 1))
        return np.concatenate([mean[None], chosen]), np.zeros(0)

    def _over_sums(self, values: FloatArray, chance: FloatArray) -> FloatArray:
        return values.max(axis=1)


@cache
def directions(k: int) -> FloatArray:
    """Return the directions ``(3 ** k - 1, k)`` to the corners, edges and faces of a cube."""
    every = np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))
    lengths = np.linalg.norm(every, axis=1)
    return every[lengths > 0] / lengths[lengths > 0, None]
