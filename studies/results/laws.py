"""Laws of growth: how a number depends on size, with intervals, and what it will be elsewhere.

Values are fitted on a scale on which noise is about equal: logarithms of positive numbers, and the
empirical logits of rates. There a law is a curve in ``x = log n``:

- ``power law``, of rates ``logistic in log n``: ``a + b x``; numbers, and odds, grow as ``n^b``;
- ``linear to quadratic``: ``log(a n (n + c))``, with c greater than -2, as pairs are for c = -1;
- ``power law with a floor``: ``log(exp(c) + exp(a + b x))``;
- ``break point``: ``a + b x + d max(0, x - k)``; the exponent is b, beyond ``n = exp(k)`` b + d.

Seeds are the unit of sampling, and all sizes of a seed are resampled together. Which law holds is
decided by sizes that are left out: each of the largest third is predicted from those below it. A
simpler law stands unless another one predicts them better by more than `MARGIN`.

A prediction of the mean of new seeds has the variance of the fit, of so many seeds, and of a law
that does not go on as it did, see `drift`. Degrees of freedom of the first two are Satterthwaite's
(1946). Values that a run did not live to see (*censored*) are only known to be larger than the last
seen, and enter the likelihood so (Tobin 1958).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...core.numerics import BoolArray, optimize, special
from .drift import Drift, Mixture, drift
from .statistics import Array, Estimate

RESAMPLES = 400
"""Resamples of seeds: of a standard error they leave 4%."""
FEW_RESAMPLES = 50
"""Of fits that only score a law."""
MARGIN = 1.0
"""By how much the log density of held-out sizes must be greater for a law of more parameters."""
FEWEST = 3
"""Sizes, below which no law is told from another."""
LEAST = 2.0
"""The smallest size of a law that is linear to quadratic, as pairs of agents are: n (n - 1)."""
FLAT = 1e-9
"""Where so little is left of the variance of seeds, it is taken for rounding."""
MOST_FREEDOM = 1e6
"""Degrees of freedom of what is as good as normal."""


class Curve(NamedTuple):
    """A family of curves in the logarithm of size."""

    name: str
    n_parameters: int
    of: Callable[[Array, Array], Array]
    """Its values for parameters ``(k,)`` at ``x`` ``(m,)``."""
    slopes: Callable[[Array, Array], Array]
    """Its derivatives by the parameters ``(m, k)`` there."""
    begins: Callable[[Array, Array], list[Array]]
    """Where a fit to values ``(m,)`` at ``x`` may begin."""
    exponents: Callable[[Array], dict[str, float]]
    """What parameters ``(k,)`` mean, by name."""


def _line(p: Array, x: Array) -> Array:
    return p[0] + p[1] * x


def _line_slopes(p: Array, x: Array) -> Array:
    return np.stack([np.ones_like(x), x], axis=1)


def _line_begins(x: Array, y: Array) -> list[Array]:
    b, a = np.polyfit(x, y, 1).tolist()
    return [np.array([a, b])]


def _quadratic(p: Array, x: Array) -> Array:
    return p[0] + x + np.log(np.exp(x) + np.exp(p[1]) - LEAST)


def _quadratic_slopes(p: Array, x: Array) -> Array:
    own = np.exp(p[1])
    return np.stack([np.ones_like(x), own / (np.exp(x) + own - LEAST)], axis=1)


def _with_floor(p: Array, x: Array) -> Array:
    return np.logaddexp(p[2], p[0] + p[1] * x)


def _floor_slopes(p: Array, x: Array) -> Array:
    share = special.expit(p[0] + p[1] * x - p[2])
    return np.stack([share, share * x, 1.0 - share], axis=1)


def _floor_begins(x: Array, y: Array) -> list[Array]:
    a, b = _line_begins(x, y)[0]
    steep = np.array([y[-1] - 2.0 * b * x[-1], 2.0 * b, y.min() - 0.1])
    return [np.array([a, b, y.min() - 3.0]), steep]


def _broken(p: Array, x: Array) -> Array:
    return p[0] + p[1] * x + p[2] * np.maximum(0.0, x - p[3])


def _broken_slopes(p: Array, x: Array) -> Array:
    beyond = np.maximum(0.0, x - p[3])
    return np.stack([np.ones_like(x), x, beyond, -p[2] * (x > p[3])], axis=1)


def _broken_begins(x: Array, y: Array) -> list[Array]:
    begins = []
    for k in x[1:-1]:
        terms = np.stack([np.ones_like(x), x, np.maximum(0.0, x - k)], axis=1)
        begins.append(np.append(np.linalg.lstsq(terms, y, rcond=None)[0], k))
    return begins


POWER = Curve(
    "power law", 2, _line, _line_slopes, _line_begins, lambda p: {"exponent": float(p[1])}
)
LOGISTIC = POWER._replace(name="logistic in log n")
QUADRATIC = Curve(
    "linear to quadratic",
    2,
    _quadratic,
    _quadratic_slopes,
    lambda x, y: [np.array([float((y - 2.0 * x).mean()), start]) for start in (0.0, 3.0)],
    lambda p: {"c of n (n + c)": float(np.exp(p[1]) - LEAST)},
)
FLOOR = Curve(
    "power law with a floor",
    3,
    _with_floor,
    _floor_slopes,
    _floor_begins,
    lambda p: {"exponent": float(p[1]), "floor": float(np.exp(p[2]))},
)
BREAK = Curve(
    "break point",
    4,
    _broken,
    _broken_slopes,
    _broken_begins,
    lambda p: {
        "exponent below": float(p[1]),
        "exponent above": float(p[1] + p[2]),
        "break": float(np.exp(p[3])),
    },
)


class Scale(NamedTuple):
    """On which values are fitted."""

    curves: tuple[Curve, ...]
    """The laws there are, simple ones first."""
    back: Callable[[Array], Array]
    """Returns values of fitted ones."""

    def interval(self, known: Mixture, level: float = 0.9) -> Estimate:
        """Return the median of a distribution of fitted values, and an interval around it."""
        shares = (0.5, 0.5 - level / 2.0, 0.5 + level / 2.0)
        return Estimate(*(np.asarray(self.back(np.asarray(known.quantile(p)))) for p in shares))


LOG = Scale((POWER, QUADRATIC, FLOOR, BREAK), np.exp)
LOGIT = Scale((LOGISTIC, BREAK), special.expit)
DIFFERENCE = Scale((LOGISTIC, BREAK), np.array)


class Sample(NamedTuple):
    """What was measured at several sizes with the same seeds."""

    sizes: Array
    """``(m,)`` in ascending order."""
    values: Array
    """``(n_seeds, m)`` on the scale."""
    censored: BoolArray
    """``(n_seeds, m)`` whether a value is only known to be larger."""
    scale: Scale

    def first(self, m: int) -> Sample:
        """Return the sample of the m smallest sizes."""
        return Sample(self.sizes[:m], self.values[:, :m], self.censored[:, :m], self.scale)


def of_numbers(sizes: Array, values: Array, censored: BoolArray | None = None) -> Sample:
    """Return a sample of positive numbers ``(n_seeds, m)``.

    Raises
    ------
    ValueError
        If a number is not positive, or all are censored.
    """
    if not (values > 0.0).all():
        raise ValueError("a power law is of positive numbers")
    unseen = np.zeros(values.shape, dtype=bool) if censored is None else censored
    if unseen.all():
        least = values.min()
        raise ValueError(
            f"no run reached the criterion: all are censored, at {least:g} decisions or more"
        )
    return Sample(sizes, np.log(values), unseen, LOG)


def of_rates(sizes: Array, successes: Array, episodes: int) -> Sample:
    """Return a sample of rates: how many of so many of a run succeeded ``(n_seeds, m)``."""
    logits = np.log((successes + 0.5) / (episodes - successes + 0.5))
    return Sample(sizes, logits, np.zeros(logits.shape, dtype=bool), LOGIT)


def apart(own: Sample, base: Sample) -> Sample:
    """Return by how much values lie above those of the same seeds at the same sizes, on the scale.

    What lets both grow alike is not in it, so that its law is left by less than theirs. Its values
    may be negative, and have the laws of logits.
    """
    both, first, second = np.intersect1d(own.sizes, base.sizes, return_indices=True)
    values = own.values[:, first] - base.values[:, second]
    censored = own.censored[:, first] | base.censored[:, second]
    return Sample(both, values, censored, DIFFERENCE)


class Law(NamedTuple):
    """A law that has been fitted."""

    curve: Curve
    sample: Sample
    parameters: Array
    """``(k,)``."""
    resampled: Array
    """``(RESAMPLES, k)`` parameters of resampled seeds."""
    noise: float
    """Variance of seeds at a size, on the scale."""
    left: Array
    """What means of seeds deviate by from the law ``(m,)``, on the scale."""
    scatter: float
    """Variance of a seed at a size, beyond what it has at all."""
    held_out: tuple[tuple[float, float, Estimate], ...] = ()
    """Of each size that was left out: size, what was measured, its 90% prediction."""

    @property
    def seeds(self) -> int:
        """How many."""
        return len(self.sample.values)

    def exponents(self, level: float = 0.95) -> dict[str, Estimate]:
        """Return what the parameters mean, with intervals: Student's of the resampled ones."""
        values = self.curve.exponents(self.parameters)
        each = [self.curve.exponents(p) for p in self.resampled]
        reach = float(special.stdtrit(self.seeds - 1, 0.5 + level / 2.0))
        estimates = {}
        for name, value in values.items():
            half = reach * self._spread(np.array([own[name] for own in each]))
            estimates[name] = Estimate(*map(np.asarray, (value, value - half, value + half)))
        return estimates

    def _spread(self, resampled: Array) -> float:
        """Return a standard error: variances of few resampled seeds fall short."""
        return float(resampled.std(axis=0, ddof=1)) * math.sqrt(self.seeds / (self.seeds - 1))

    def predict(self, size: float, level: float = 0.9, seeds: int | None = None) -> Estimate:
        """Return the mean of so many new seeds at a size, by default as many as were fitted.

        Of numbers it is the geometric mean.
        """
        return self.sample.scale.interval(self.distribution(size, seeds), level)

    def distribution(self, size: float, seeds: int | None = None) -> Mixture:
        """Return the distribution of a prediction, on the scale."""
        x = np.log([size])
        m = len(self.sample.sizes)
        parts = [
            (self._spread(self._resampled_at(x)) ** 2, self.seeds - 1.0),
            (self.noise / (seeds or self.seeds), (self.seeds - 1.0) * m),
        ]
        left = self._drift(x)
        value = float(self.curve.of(self.parameters, x)[0])
        return _mixed(left.weights, value + left.shifts, left.variances, parts)

    def _resampled_at(self, x: Array) -> Array:
        """Return the laws of resampled seeds ``(RESAMPLES,)`` at ``x`` ``(1,)``."""
        return np.array([self.curve.of(p, x)[0] for p in self.resampled])

    def _drift(self, x: Array) -> Drift:
        """Return how far the law may be left at ``x`` ``(1,)``."""
        fitted = np.log(self.sample.sizes)
        slopes = self.curve.slopes(self.parameters, np.append(fitted, x))
        return drift(
            fitted, float(x[0]), self.left, slopes[:-1], slopes[-1], self.scatter / self.seeds
        )

    def curve_at(self, sizes: Array) -> Array:
        """Return the law's values ``(k,)`` at sizes."""
        return self.sample.scale.back(self.curve.of(self.parameters, np.log(sizes)))


def _mixed(
    weights: Array, means: Array, variances: Array, parts: Sequence[tuple[float, float]]
) -> Mixture:
    """Return a mixture of what varies in itself and by `parts`, each a variance and its freedom.

    Degrees of freedom of sums are Satterthwaite's (1946).
    """
    total = variances + sum(part for part, _ in parts) + FLAT**2
    lack = sum(part**2 / freedom for part, freedom in parts)
    return Mixture(weights, means, total, np.minimum(total**2 / (lack + FLAT**6), MOST_FREEDOM))


def fit(curve: Curve, sample: Sample, resamples: int = RESAMPLES) -> Law:
    """Fit a curve by least squares, or where values are censored by maximum likelihood."""
    x = np.log(sample.sizes)
    values = sample.values
    n_seeds, m = values.shape
    parameters = _fitted(curve, x, values, sample.censored, curve.begins(x, values.mean(axis=0)))
    drawn = np.random.default_rng(0).integers(n_seeds, size=(resamples, n_seeds))
    if curve.of is _line and not sample.censored.any():  # all at once
        resampled = np.polynomial.polynomial.polyfit(x, values[drawn].mean(axis=1).T, 1).T
    else:
        each = [(values[r], sample.censored[r]) for r in drawn]
        resampled = np.array([_fitted(curve, x, *own, [parameters]) for own in each])
    at = curve.of(parameters, x)
    left = values - at
    seen = ~sample.censored
    if seen.all():
        noise = float(values.var(axis=0, ddof=1).mean())
        own = left - left.mean(axis=1, keepdims=True)
        scatter = min(noise, float(own.var(axis=0, ddof=1).mean()) * m / (m - 1.0))
    else:
        noise = float((left[seen] ** 2).mean())
        scatter = noise
        deviation = math.sqrt(noise)
        z = left[~seen] / deviation  # means of what lies beyond, as the law has it
        hazard = np.exp(-0.5 * z**2 - 0.5 * math.log(2.0 * math.pi) - special.log_ndtr(-z))
        left[~seen] = deviation * hazard
    return Law(curve, sample, parameters, resampled, noise, left.mean(axis=0), scatter)


def _fitted(
    curve: Curve, x: Array, values: Array, censored: BoolArray, begins: Sequence[Array]
) -> Array:
    """Return the parameters ``(k,)`` of values ``(n_seeds, m)``; a search begins at `begins`."""
    means = values.mean(axis=0)
    if not censored.any():
        if curve.of is _line:
            return _line_begins(x, means)[0]

        def off(p: Array) -> Array:
            return curve.of(p, x) - means

        def slopes(p: Array) -> Array:
            return curve.slopes(p, x)

        fits = [optimize.least_squares(off, own, slopes) for own in begins]
        return np.asarray(min(fits, key=lambda one: one.cost).x)

    def lack(p: Array) -> float:
        deviation = math.exp(p[-1])
        z = (values - curve.of(p[:-1], x)) / deviation
        seen = -0.5 * z[~censored] ** 2 - p[-1]
        return -float(seen.sum() + special.log_ndtr(-z[censored]).sum())

    spread = math.log(max(values.std(), 1e-3))
    fits = [optimize.minimize(lack, np.append(own, spread), method="Nelder-Mead") for own in begins]
    return np.asarray(min(fits, key=lambda one: one.fun).x[:-1])


def choose(sample: Sample, *, curves: Sequence[Curve] = ()) -> Law:
    """Return the law that predicts best the sizes that are left out.

    Parameters
    ----------
    sample
        Of `FEWEST` sizes at least, and two seeds.
    curves
        Which laws are compared; by default those of the scale.

    Raises
    ------
    ValueError
        If there are fewer sizes or seeds; one line.
    """
    n_seeds, m = sample.values.shape
    if m < FEWEST or n_seeds < 2:
        raise ValueError(
            f"{m} size{'s' * (m != 1)} and {n_seeds} seed{'s' * (n_seeds != 1)}: a law takes "
            f"{FEWEST} sizes and 2 seeds or more"
        )
    laws = [c for c in curves or sample.scale.curves if c.n_parameters < m]
    chosen = laws[0]
    checks = _held_out(chosen, sample)
    score = sum(density for density, _ in checks)
    for curve in laws[1:]:
        others = _held_out(curve, sample)
        density = sum(own for own, _ in others)
        if len(others) == len(checks) > 0 and density > score + MARGIN:
            chosen, checks, score = curve, others, density
    return fit(chosen, sample)._replace(held_out=tuple(check for _, check in checks))


def _held_out(curve: Curve, sample: Sample) -> list[tuple[float, tuple[float, float, Estimate]]]:
    """Return of each of the largest third of sizes its log density, and how it was predicted.

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
        mean = float(sample.values[:, k].mean())
        known = law.distribution(size)
        measured = float(sample.scale.back(np.asarray(mean)))
        checks.append((known.log_density(mean), (size, measured, sample.scale.interval(known))))
    return checks


class Contrast(NamedTuple):
    """The exponent of a law less that of another one."""

    difference: Estimate
    p: float
    """That there is none, Student's over seeds."""
    deviation: float
    """Standard deviation of the differences of single seeds."""


def compare(law: Law, base: Law) -> Contrast:
    """Return the difference of the exponents of two power laws of the same seeds and sizes."""
    slopes = [
        np.polyfit(np.log(own.sample.sizes), own.sample.values.T, 1)[0] for own in (law, base)
    ]
    each = slopes[0] - slopes[1]
    seeds = len(each)
    value = float(each.mean())
    deviation = float(each.std(ddof=1))
    error = deviation / math.sqrt(seeds)
    half = float(special.stdtrit(seeds - 1, 0.975)) * error
    ends = map(np.asarray, (value, value - half, value + half))
    p = float(2.0 * special.stdtr(seeds - 1, -abs(value) / error)) if error > FLAT else 1.0
    return Contrast(Estimate(*ends), p if error > FLAT or not value else 0.0, deviation)
