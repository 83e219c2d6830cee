"""Laws of growth: a measure as a function of size, with intervals and predictions.

A law describes the mean over seeds, on a scale on which it is a simple curve in ``x = log n``: the
logarithm of a positive mean, or the log odds of a rate.

- ``power law``, for rates ``logistic in log n``: ``a + b x``; means, or odds, grow as ``n^b``;
- ``linear to quadratic``: ``log(a n (n + c))``, c above -1, as pairs of agents grow at c = -1;
- ``power law with a floor``: ``log(exp(c) + exp(a + b x))``;
- ``break point``: ``a + b x + d max(0, x - k)``; the exponent is b, beyond ``n = exp(k)`` b + d;
- ``linear``: ``log(a (n + c))``, c above -1, for counts such as the messages of a star, ``n - 1``.

Seeds are the unit of sampling, and all sizes of a seed are resampled together. The values of seeds
are linearized at their mean (delta method), so that the mean of the linearized values is exactly
the mean of the table on the scale. Which law holds is decided by sizes that are left out: each of
the largest third is predicted from those below it. A simpler law stands unless another one predicts
them better by more than `MARGIN`.

The interval of a prediction, the mean of new seeds, has the variance of the fit, of that number of
seeds, and of an exponent that drifts beyond the measured sizes, see `drift`. Degrees of freedom of
the first two are Satterthwaite's (1946). Rates of new seeds are drawn from binomial distributions.
Values that a run did not reach (*censored*) are only known to be larger than the last one seen, and
enter the likelihood so (Tobin 1958); laws of them describe geometric means.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.numerics import BoolArray, optimize, pd, special
from ..results.permutation_tests import paired_permutation
from ..results.statistics import Array, Estimate
from .curves import LINEAR, POWER, QUADRATIC, Curve
from .drift import Mixture, drift
from .inference import student_quantile
from .samples import FLAT, LOG, LOGIT, Sample, check_sizes

RESAMPLES = 400
"""Resamples of seeds, which estimate a standard error to 4%."""
FEW_RESAMPLES = 50
"""Resamples for fits that only score a law."""
MARGIN = 1.0
"""Difference of the log densities of held-out sizes that a law of more parameters needs."""
FEWEST = 3
"""Minimum number of sizes of a law."""
NEAR = 1e-6
"""Deviation, relative to a value, up to which a law passes through it."""
MOST_FREEDOM = 1e6
"""Degrees of freedom of an almost normal distribution."""
MAX_LOG_DEVIATION = 30.0
"""Bound of the logarithm of a standard deviation in a search."""
DRAWS = 4000
"""Draws of the rate of new seeds."""


class Law(NamedTuple):
    """A fitted law."""

    curve: Curve
    sample: Sample
    parameters: Array
    """``(k,)``."""
    resampled: Array
    """``(RESAMPLES, k)`` parameters of resampled seeds."""
    noise: float
    """Variance of a seed of weight 1 at a size, on the scale."""
    left: Array
    """Deviations of the means of seeds from the law ``(m,)``, on the scale."""
    scatter: float
    """Variance of a seed of weight 1 at a size around its own mean."""
    held_out: tuple[tuple[float, float, Estimate], ...] = ()
    """For each size that was left out: size, measured mean, its 90% prediction."""
    left_out: int = 0
    """Number of runs that were left out because their seeds lack another size."""

    @property
    def seeds(self) -> int:
        """Number of seeds."""
        return len(self.sample.values)

    @property
    def is_exact(self) -> bool:
        """Whether all seeds agree, and the law passes through all values."""
        return self.sample.is_flat and bool(np.abs(self.left).max() <= NEAR)

    @property
    def formula(self) -> str:
        """The law as an equation in n."""
        return f"{self.sample.scale.quantity} = {self.curve.formula(self.parameters)}"

    def exponents(self) -> dict[str, Estimate]:
        """Return the meaning of the parameters, with Student intervals of resampled seeds."""
        values = self.curve.exponents(self.parameters)
        resampled = pd.DataFrame([self.curve.exponents(p) for p in self.resampled])
        halves = student_quantile(self.seeds) * self._spread(resampled.to_numpy())
        return {
            name: Estimate(*map(np.asarray, (value, value - half, value + half)))
            for (name, value), half in zip(values.items(), halves, strict=True)
        }

    def _spread(self, resampled: Array) -> Array:
        """Return standard errors; resampling few seeds underestimates them by a known factor."""
        return np.asarray(resampled.std(axis=0, ddof=1)) * math.sqrt(self.seeds / (self.seeds - 1))

    def predict(self, size: float, level: float = 0.9, seeds: int | None = None) -> Estimate:
        """Return the law at a size, with an interval of the mean of so many new seeds there.

        By default they are as many as were fitted. The interval follows the drift of the largest
        sizes; it contains the law and lies within the sample's bounds.
        """
        check_sizes(np.array(size))
        shares = 0.5 - level / 2.0, 0.5 + level / 2.0
        if self.sample.scale is LOGIT:
            rates = self._new_rates(size, seeds or self.seeds)
            low, high = np.quantile(rates, shares, method="inverted_cdf").tolist()
        else:
            known = self.distribution(size, self.noise / (seeds or self.seeds))
            low, high = self.sample.scale.back(np.array([known.quantile(p) for p in shares]))
        value = float(self.curve_at(np.array([size]))[0])
        ends = min(value, float(low)), max(value, float(high))
        return Estimate(*(np.asarray(np.clip(end, *self.sample.bounds)) for end in (value, *ends)))

    def distribution(self, size: float, noise: float | None = None) -> Mixture:
        """Return the distribution of the mean of new seeds on the scale, the drift included.

        `noise` is the variance of that mean at weight 1, by default that of as many seeds as were
        fitted. The parts of the variance that are estimated have Satterthwaite's (1946) degrees of
        freedom, at most `MOST_FREEDOM`.
        """
        sample = self.sample
        fitted, x = np.log(sample.sizes), np.log([size])
        value = self.curve.of(self.parameters, x)
        drawn = np.array([self.curve.of(p, x)[0] for p in self.resampled])
        of_fit = float(self._spread(drawn)) ** 2
        own_noise = self.noise / self.seeds if noise is None else noise
        of_seeds = own_noise / float(sample.scale.weight(value)[0])
        slopes = self.curve.slopes(self.parameters, np.append(fitted, x))
        errors = self.scatter / self.seeds / sample.weights
        weights, shifts, variances = drift(
            fitted, float(x[0]), self.left, slopes[:-1], slopes[-1], errors
        )
        total = variances + of_fit + of_seeds + FLAT**2
        lack = (of_fit**2 + of_seeds**2 / len(fitted)) / (self.seeds - 1.0)
        freedoms = np.minimum(total**2 / (lack + FLAT**6), MOST_FREEDOM)
        return Mixture(weights, float(value[0]) + shifts, total, freedoms)

    def _new_rates(self, size: float, seeds: int) -> Array:
        """Return draws of the mean rate of new seeds: binomial, with their effective number."""
        rng = np.random.default_rng(0)
        rates = special.expit(self.distribution(size, 0.0).sample(rng, DRAWS))
        count = max(1, round(4.0 * seeds / self.noise))
        return rng.binomial(count, rates) / count

    def curve_at(self, sizes: Array) -> Array:
        """Return the law's values ``(k,)`` at sizes."""
        return self.sample.scale.back(self.curve.of(self.parameters, np.log(sizes)))


def fit(curve: Curve, sample: Sample, resamples: int = RESAMPLES) -> Law:
    """Fit a curve by weighted least squares, or to censored values by maximum likelihood."""
    x = np.log(sample.sizes)
    values = sample.values
    n_seeds, m = values.shape
    begins = curve.begins(x, values.mean(axis=0))
    parameters = _fitted(curve, sample, values, sample.censored, begins)
    drawn = np.random.default_rng(0).integers(n_seeds, size=(resamples, n_seeds))
    if curve.of is POWER.of and not sample.censored.any():  # all at once
        means = values[drawn].mean(axis=1).T
        resampled = np.polynomial.polynomial.polyfit(x, means, 1, w=np.sqrt(sample.weights)).T
    else:
        each = [(values[r], sample.censored[r]) for r in drawn]
        resampled = np.array([_fitted(curve, sample, *own, [parameters]) for own in each])
    left = values - curve.of(parameters, x)
    seen = ~sample.censored
    if seen.all():
        noise = max(_variance(values, sample.weights), sample.min_noise)
        own = left - np.average(left, axis=1, weights=sample.weights)[:, None]
        scatter = min(noise, _variance(own, sample.weights) * m / (m - 1.0))
        scatter = max(scatter, sample.min_noise)
    else:
        noise = float((left[seen] ** 2).mean())
        scatter = noise
        deviation = math.sqrt(noise)
        left[~seen] = deviation * mean_of_tail(left[~seen] / deviation)
    return Law(curve, sample, parameters, resampled, noise, left.mean(axis=0), scatter)


def mean_of_tail(z: Array) -> Array:
    """Return the mean of a standard normal variable that is known to exceed each z."""
    return np.exp(-0.5 * z**2 - 0.5 * math.log(2.0 * math.pi) - special.log_ndtr(-z))


def _variance(values: Array, weights: Array) -> float:
    """Return the variance of a seed of weight 1, pooled over sizes."""
    return float(np.average(weights * values.var(axis=0, ddof=1), weights=weights))


def _fitted(
    curve: Curve, sample: Sample, values: Array, censored: BoolArray, begins: Sequence[Array]
) -> Array:
    """Return the parameters ``(k,)`` for values ``(n_seeds, m)``; searches start at `begins`."""
    x = np.log(sample.sizes)
    means = values.mean(axis=0)
    roots = np.sqrt(sample.weights)
    if not censored.any():
        if curve.of is POWER.of:
            return np.asarray(np.polynomial.polynomial.polyfit(x, means, 1, w=roots))

        def off(p: Array) -> Array:
            return roots * (curve.of(p, x) - means)

        def slopes(p: Array) -> Array:
            return roots[:, None] * curve.slopes(p, x)

        fits = [optimize.least_squares(off, own, slopes, method="lm") for own in begins]
        return np.asarray(min(fits, key=lambda one: one.cost).x)

    def lack(p: Array) -> float:
        log_deviation = float(np.clip(p[-1], -MAX_LOG_DEVIATION, MAX_LOG_DEVIATION))
        z = (values - curve.of(p[:-1], x)) * math.exp(-log_deviation)
        seen = -0.5 * z[~censored] ** 2 - log_deviation
        return -float(seen.sum() + special.log_ndtr(-z[censored]).sum())

    spread = math.log(max(values.std(), 1e-3))
    fits = [optimize.minimize(lack, np.append(own, spread), method="Nelder-Mead") for own in begins]
    return np.asarray(min(fits, key=lambda one: one.fun).x[:-1])


def choose(sample: Sample) -> Law:
    """Return the law of the scale that best predicts the sizes that are left out.

    Raises
    ------
    ValueError
        If there are fewer than `FEWEST` sizes, or fewer than two seeds; one line.
    """
    n_seeds, m = sample.values.shape
    if m < FEWEST or n_seeds < 2:
        raise ValueError(
            f"{m} size{'s' * (m != 1)} and {n_seeds} seed{'s' * (n_seeds != 1)}: a law takes "
            f"{FEWEST} sizes and 2 seeds or more"
        )
    if (exact := _exact(sample)) is not None:
        return exact
    laws = [c for c in sample.scale.curves if c.n_parameters < m]
    chosen = laws[0]
    checks = _held_out(chosen, sample)
    score = sum(density for density, _ in checks)
    for curve in laws[1:]:
        others = _held_out(curve, sample)
        density = sum(own for own, _ in others)
        if len(others) == len(checks) > 0 and density > score + MARGIN:
            chosen, checks, score = curve, others, density
    return fit(chosen, sample)._replace(held_out=tuple(check for _, check in checks))


def _exact(sample: Sample) -> Law | None:
    """Return a law that passes through all values of seeds that agree; None if none does.

    Such values are counts of a hierarchy, such as its messages.
    """
    for curve in (POWER, QUADRATIC, LINEAR) if sample.scale is LOG and sample.is_flat else ():
        law = fit(curve, sample, FEW_RESAMPLES)
        if law.is_exact:
            return law
    return None


def _held_out(curve: Curve, sample: Sample) -> list[tuple[float, tuple[float, float, Estimate]]]:
    """Return for each of the largest third of sizes its log density, and its prediction.

    It is predicted from the sizes below it. Sizes with censored values, or with too few below them,
    are passed over.
    """
    m = len(sample.sizes)
    checks = []
    for k in range(m - max(1, m // 3), m):
        if k <= curve.n_parameters or sample.censored[:, k].any():
            continue
        law = fit(curve, sample.first(k), FEW_RESAMPLES)
        size = float(sample.sizes[k])
        density = law.distribution(size).log_density(float(sample.values[:, k].mean()))
        checks.append((density, (size, float(sample.means[k]), law.predict(size))))
    return checks


def compare(law: Law, base: Law) -> tuple[Array, float]:
    """Return the differences of the exponents of two power laws by seed, and p.

    Seeds and sizes are the same. p, for no difference, is that of all permutations of signs.
    """
    first, second = (
        np.polyfit(np.log(own.sizes), own.values.T, 1, w=np.sqrt(own.weights))[0]
        for own in (law.sample, base.sample)
    )
    is_equal = np.abs(first - second).max() <= FLAT  # the signs of rounding say nothing
    p = 1.0 if is_equal else paired_permutation(first, second)
    return first - second, p
