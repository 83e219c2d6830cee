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

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from ..arrays import FloatArray, IntArray
from ..rules.rule_base import RuleBase
from ..settings import AnovaTDSettings
from .batch import REWARD_SCALE, Replay, _lambda_returns, _moment
from .dictionary import Dictionary

MOST_RULES = 5**9
"""Of one agent; beyond, the weights alone take more memory than a workstation has to spare."""


class AnovaTD(Replay):
    """Batch TD(lambda) of one product of all variables.

    Raises
    ------
    ValueError
        If the rule base is another, or has more than `MOST_RULES`.
    """

    largest = MOST_RULES
    remedy = "use fewer variables or memberships"

    def __init__(self, settings: AnovaTDSettings, rules: RuleBase, n_agents: int) -> None:
        d = len(rules.partitions)
        if rules.terms != (tuple(range(d)),):
            raise ValueError(
                f"learner.rule_base: anova-td learns one product of all {d} variables; "
                f"set learner.rule_base.order = {d} and no products"
            )
        super().__init__(settings, rules, n_agents)
        self._anova = settings
        self._sizes = [p.size for p in rules.partitions]
        self._dictionaries = self._empty()
        # u of all agents, padded with zeros.
        self._coefficients: FloatArray = np.zeros((n_agents, settings.dictionary))

    def _empty(self) -> list[Dictionary]:
        s = self._anova
        return [
            Dictionary(self._sizes, s.interaction, s.tolerance, s.dictionary) for _ in self.theta
        ]

    def _regress(self) -> int:
        self._extend()
        s = self._anova
        rewards, follower, known, low, high = self._experience()
        for i, held in enumerate(self._dictionaries):
            z = held.coordinates
            gram = (known[:, None] * z).T @ z + s.ridge * np.eye(z.shape[1])
            factor = cho_factor(gram, check_finite=False)
            before = self._coefficients[i, : z.shape[1]]
            u = before
            for _ in range(s.sweeps):
                targets = known * np.clip(self._targets(i, u, rewards, follower), low, high)
                u = cho_solve(factor, targets @ z, check_finite=False)
            self._coefficients[i, : z.shape[1]] += s.mixing * (u - before)
            self.theta[i] = self._consequents(i) / REWARD_SCALE
        return self.theta.size

    def _targets(
        self, agent: int, theta: FloatArray, rewards: FloatArray, follower: IntArray
    ) -> FloatArray:
        """Return the lambda-returns ``(N,)`` by coefficients; arbitrary where cut off."""
        values = self._dictionaries[agent].coordinates @ theta
        return _lambda_returns(
            values, rewards, follower, self._anova.discount, self._anova.trace_decay
        )

    def _consequents(self, agent: int) -> FloatArray:
        """Return theta of the coefficients of an agent."""
        held = self._dictionaries[agent]
        u = self._coefficients[agent, : len(held.members)]
        alpha = solve_triangular(held.factor, u, lower=True, trans="T", check_finite=False)
        states = np.array([self._states[s][agent] for s in held.members])
        active, strengths = self.rules.active(states)
        moment = _moment(active, strengths, alpha, self.rules.n_rules)
        return spread(moment, self._sizes, self._anova.interaction)

    def _extend(self) -> None:
        """Find the coordinates of the after-states that are new since the last regression."""
        new = np.array(self._states[self._dictionaries[0].n_states :])
        for i, held in enumerate(self._dictionaries if len(new) else ()):
            degrees = [p.strengths(new[:, i, j]) for j, p in enumerate(self.rules.partitions)]
            held.add(np.concatenate(degrees, axis=1))

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, coefficients and all experience."""
        return {**super().arrays(), "coefficients": self._coefficients}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore(arrays)
        self._coefficients = arrays["coefficients"].copy()
        self._dictionaries = self._empty()


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
