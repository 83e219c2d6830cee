"""Batch TD of the full product rule base, under a prior that prefers few variables at a time.

A full product has more rules than there will ever be experience: 5^8 = 390,625 over the relational
variables, of which an agent that learns each for itself meets a few hundred. But functions of one
variable, of two, and so on are all in its span, since the memberships of a variable sum to one.
What lacks is a preference among them, as smoothing-spline analysis of variance has it (Wahba 1990,
ch. 10; Durrande, Ginsbourger and Roustant 2012). Before anything is seen, the consequents theta
have the covariance

    C = (prod_j (11' + rho I) - prod_j 11') / rho      (Kronecker products over the variables j)

so that f = phi'theta is a Gaussian process whose kernel sums over all sets of variables::

    k(s, t) = phi(s)' C phi(t) = (prod_j (1 + rho k_j) - 1) / rho
            = sum_j k_j + rho sum_{j<l} k_j k_l + rho^2 sum_{j<l<m} k_j k_l k_m + ...

with k_j = w_j(s)'w_j(t) of the memberships w_j of variable j. With rho towards zero this is the
ridge regression of the order-1 rule base; every further variable in an interaction costs rho.

States are regressed on by their coordinates z under this kernel (`dictionary`). The coefficients u
that minimise squared errors plus ``ridge`` u'u give the weights of all rules at once, with L the
factor and Phi the feature vectors of the dictionary::

    theta = C Phi' L'^-1 u

They are consequent weights like any others: the agent decides by its rules, not by the kernel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.settings import Fraction
from ..rules.kernels import regression
from ..rules.rule_base import RuleBase
from .batch import REWARD_SCALE, ReplayLearner, ReplaySettings
from .dictionary import Dictionary

MOST_RULES = 5**9
"""Of one agent; beyond, the weights alone take more memory than a workstation has to spare."""


class AnovaTDSettings(ReplaySettings):
    """Batch TD(lambda) of the full product, with a prior that prefers few variables at a time."""

    kind: Literal["anova-td"] = "anova-td"
    factory: ClassVar[str] = f"{__name__}:AnovaTD"
    trace_decay: Fraction = 0.0
    """Trace decay lambda, as of batch TD."""
    interaction: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] = 0.1
    """Interaction rho: prior variance of a function of k + 1 variables over that of one of k."""
    tolerance: Annotated[float, Field(gt=0, le=1)] = 0.01
    """Share of its prior variance that may be left out of an after-state."""
    dictionary: Annotated[int, Field(ge=1, le=4096)] = 800
    """After-states that all others are described by, at most."""


class AnovaTD(ReplayLearner):
    """Batch TD(lambda) of one product of all variables.

    Raises
    ------
    ValueError
        If the rule base is another, or has more than `MOST_RULES`.
    """

    largest = MOST_RULES
    remedy = "use fewer variables or memberships"

    def __init__(self, settings: AnovaTDSettings, rules: RuleBase, rows: IntArray) -> None:
        d = len(rules.partitions)
        if rules.terms != (tuple(range(d)),):
            raise ValueError(
                f"learner.rule_base: anova-td learns one product of all {d} variables; "
                f"set learner.rule_base.order = {d} and no products"
            )
        super().__init__(settings, rules, rows)
        self._anova = settings
        self._sizes = [p.size for p in rules.partitions]
        self._dictionaries = self._empty()
        self._described = 0  # steps whose after-states have coordinates
        # u of all rows, padded with zeros.
        self._coefficients: FloatArray = np.zeros((len(self.theta), settings.dictionary))

    def _empty(self) -> list[Dictionary]:
        s = self._anova
        return [
            Dictionary(self._sizes, s.interaction, s.tolerance, s.dictionary) for _ in self.theta
        ]

    def _regress(self) -> int:
        from scipy.linalg import cho_factor, cho_solve

        self._extend()
        s = self._anova
        for row, held in enumerate(self._dictionaries):
            rewards, follower, known, low, high = self.experience(row)
            z = held.coordinates
            gram = (known[:, None] * z).T @ z + s.ridge * np.eye(z.shape[1])
            factor = cho_factor(gram, check_finite=False)
            before = self._coefficients[row, : z.shape[1]]
            u = before
            for _ in range(s.regression_iterations):
                returns = regression.lambda_returns(
                    z @ u, rewards, follower, s.discount, s.trace_decay
                )
                targets = known * np.clip(returns, low, high)
                u = cho_solve(factor, targets @ z, check_finite=False)
            change = s.target_averaging_rate * (u - before)
            self._coefficients[row, : z.shape[1]] += change
            self.theta[row] = self._consequents(row) / REWARD_SCALE
        return self.theta.size

    def _consequents(self, row: int) -> FloatArray:
        """Return theta of the coefficients of a row."""
        from scipy.linalg import solve_triangular

        held = self._dictionaries[row]
        u = self._coefficients[row, : len(held.members)]
        alpha = solve_triangular(held.factor, u, lower=True, trans="T", check_finite=False)
        active, strengths = self.rules.active(self.states_of(row)[held.members])
        moment = regression.moment(active, strengths, alpha, self.rules.n_rules)
        return spread(moment, self._sizes, self._anova.interaction)

    def _extend(self) -> None:
        """Find the coordinates of the after-states that are new since the last regression."""
        if self._described == len(self._states):
            return
        for row, held in enumerate(self._dictionaries):
            new = self.states_of(row, self._described)
            degrees = [p.strengths(new[:, j]) for j, p in enumerate(self.rules.partitions)]
            held.add(np.concatenate(degrees, axis=1))
        self._described = len(self._states)

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, coefficients and all experience."""
        return {**super().arrays(), "coefficients": self._coefficients}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore(arrays)
        self._coefficients = arrays["coefficients"].copy()
        self._dictionaries, self._described = self._empty(), 0

    def continue_from(self, former: ReplayLearner, rows: IntArray) -> None:
        """Begin with weights and experience of another team, of which no episode is under way."""
        super().continue_from(former, rows)
        assert isinstance(former, AnovaTD)
        # Coordinates follow from the order of the after-states, which stays the same.
        self._coefficients = former._coefficients[rows]


def spread(moment: FloatArray, sizes: Sequence[int], rho: float) -> FloatArray:
    """Return C times ``moment (n_rules,)``, one variable after the other.

    Examples
    --------
    Two variables with LOW and HIGH, a rule each in common, rho = 1/2:
    C = ((11' + I/2) x (11' + I/2) - 11' x 11') * 2.

    >>> spread(np.array([1.0, 0.0, 0.0, 0.0]), (2, 2), 0.5).tolist()
    [2.5, 1.0, 1.0, 0.0]
    """
    tensor = moment.reshape(sizes)
    for axis in range(len(sizes)):
        tensor = tensor.sum(axis=axis, keepdims=True) + rho * tensor
    consequents: FloatArray = (tensor.ravel() - moment.sum()) / rho
    return consequents
