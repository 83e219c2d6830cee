"""Deviation from a law beyond the measured sizes, because its exponent drifts.

The exponent is taken for a random walk in ``x = log n``, so that values deviate from the law by an
integrated Wiener process (Wahba 1978) that is zero at the smallest size. What it wanders by, sigma
for a growth by a factor of e, is not known: predictions are averaged over it, weighted by the
restricted likelihood of the sizes that were measured and by half a Cauchy distribution of scale
`WANDER` (Gelman 2006). Sizes that meet a law exactly leave nothing to wander; three sizes tell
little of it, and their predictions are wide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.numerics import optimize, special, stats
from ..results.statistics import Array

WANDER = 0.3
"""Scale of the prior of sigma."""
SIGMAS = np.concatenate([[0.0], np.geomspace(1e-4, 30.0, 50)])
"""Grid of sigma over which predictions are averaged."""
PRIOR = np.gradient(SIGMAS) / (1.0 + (SIGMAS / WANDER) ** 2)
EXACT = 1e-12
"""Variance of rounding."""
TINY = float(np.finfo(float).tiny)


class Mixture(NamedTuple):
    """Student's distributions, each with its weight ``(s,)``."""

    weights: Array
    means: Array
    variances: Array
    freedoms: Array

    def quantile(self, p: float) -> float:
        """Return below which number a share `p` of the distribution lies."""
        each = self.means + special.stdtrit(self.freedoms, p) * np.sqrt(self.variances)
        held = each[self.weights > 0.0]
        low, high = float(held.min()), float(held.max())
        if high - low <= EXACT:
            return low
        return float(optimize.brentq(lambda t: self._below(t) - p, low - EXACT, high + EXACT))

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return draws ``(count,)``."""
        part = rng.choice(len(self.weights), size=count, p=self.weights)
        deviations = rng.standard_t(self.freedoms[part])
        return self.means[part] + np.sqrt(self.variances[part]) * deviations

    def _below(self, t: float) -> float:
        z = (t - self.means) / np.sqrt(self.variances)
        return float(self.weights @ special.stdtr(self.freedoms, z))

    def log_density(self, value: float) -> float:
        """Return the logarithm of the density at a number."""
        widths = np.sqrt(self.variances)
        each = stats.t.logpdf((value - self.means) / widths, self.freedoms) - np.log(widths)
        most = float(each.max())
        return most + float(np.log(self.weights @ np.exp(each - most) + TINY))


def drift(
    x: Array, at: float, left: Array, slopes: Array, slope: Array, noise: Array
) -> tuple[Array, Array, Array]:
    """Return how far a law that was fitted at ``x`` may be left at `at`, for each of `SIGMAS`.

    Returns their posterior weights, the expected deviations from the law, and the variances of
    the deviations beyond those of the law's parameters, ``(s,)`` each.

    Parameters
    ----------
    x
        Logarithms of sizes ``(m,)``.
    at
        That of the size which is predicted.
    left
        What means deviate by from the law ``(m,)``, on its scale.
    slopes, slope
        Derivatives of the law by its parameters ``(m, k)``, and at `at` ``(k,)``.
    noise
        Variances of the means ``(m,)``.
    """
    u, s, vt = np.linalg.svd(slopes, full_matrices=False)
    rank = int((s > 1e-9 * s[0]).sum())
    terms = u[:, :rank]
    there = (vt @ slope)[:rank] / s[:rank]
    places = np.append(x, at) - x[0]
    walk = integrated_wiener(places)
    scales = SIGMAS**2
    # Below, the first axis is that of SIGMAS.
    inverse = np.linalg.inv(scales[:, None, None] * walk[:-1, :-1] + np.diag(noise + EXACT))
    information = terms.T @ inverse @ terms
    own = np.linalg.solve(information, (terms.T @ (inverse @ left)[..., None]))[..., 0]
    rest = left - own @ terms.T
    carried = scales[:, None] * (inverse @ walk[:-1, -1])
    unseen = there - carried @ terms
    fit = np.linalg.slogdet(information)[1] - np.linalg.slogdet(inverse)[1]
    misfit = np.einsum("si,sij,sj->s", rest, inverse, rest)
    spread = np.linalg.solve(information, unseen[..., None])[..., 0]
    likelihoods = -0.5 * (fit + misfit)
    shifts = own @ there + (carried * rest).sum(axis=1)
    variances = scales * (walk[-1, -1] - carried @ walk[:-1, -1]) + (unseen * spread).sum(axis=1)
    weights = PRIOR * np.exp(likelihoods - likelihoods.max())
    extra = np.maximum(variances - variances[0], 0.0)
    return weights / weights.sum(), shifts, extra


def integrated_wiener(x: Array) -> Array:
    """Return covariances ``(m, m)`` at places beyond zero: ``a^2 (3 b - a) / 6`` for ``a <= b``."""
    least = np.minimum.outer(x, x)
    most = np.maximum.outer(x, x)
    return least**2 * (3.0 * most - least) / 6.0
