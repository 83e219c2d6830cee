"""Laws of growth: a measure as a function of size, with intervals and predictions.

A law describes the mean over seeds, on a scale on which it is a simple curve in ``x = log n``: the
logarithm of a positive mean, or the log odds of a rate.

- ``power law``, for rates ``logistic in log n``: ``a + b x``; means, or odds, grow as ``n^b``;
- ``linear to quadratic``: ``log(a n (n + c))``, c above -1, as pairs of agents grow at c = -1;
- ``power law with a floor``: ``log(exp(c) + exp(a + b x))``;
- ``break point``: ``a + b x + d max(0, x - k)``; the exponent is b, beyond ``n = exp(k)`` b + d.

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
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...core.numerics import BoolArray, optimize, special
from .drift import Drift, Mixture, drift
from .statistics import Array, Estimate

RESAMPLES = 400
"""Resamples of seeds, which estimate a standard error to 4%."""
FEW_RESAMPLES = 50
"""Resamples for fits that only score a law."""
MARGIN = 1.0
"""Difference of the log densities of held-out sizes that a law of more parameters needs."""
FEWEST = 3
"""Minimum number of sizes of a law."""
MIN_SIZE = 1.0
"""Minimum size."""
FLAT = 1e-9
"""Variance of seeds that counts as rounding."""
MOST_FREEDOM = 1e6
"""Degrees of freedom of an almost normal distribution."""
MAX_LOG_DEVIATION = 30.0
"""Bound of the logarithm of a standard deviation in a search."""
DRAWS = 4000
"""Draws of the rate of new seeds."""


class Curve(NamedTuple):
    """A family of curves in the logarithm of size."""

    name: str
    n_parameters: int
    of: Callable[[Array, Array], Array]
    """Values for parameters ``(k,)`` at ``x`` ``(m,)``."""
    slopes: Callable[[Array, Array], Array]
    """Derivatives by the parameters ``(m, k)`` at ``x``."""
    begins: Callable[[Array, Array], list[Array]]
    """Initial parameters of a fit to values ``(m,)`` at ``x``."""
    exponents: Callable[[Array], dict[str, float]]
    """Meaning of parameters ``(k,)`` by name."""
    formula: Callable[[Array], str]
    """The curve as a formula in n."""


def _line(p: Array, x: Array) -> Array:
    return p[0] + p[1] * x


def _line_slopes(p: Array, x: Array) -> Array:
    return np.stack([np.ones_like(x), x], axis=1)


def _line_begins(x: Array, y: Array) -> list[Array]:
    b, a = np.polyfit(x, y, 1).tolist()
    return [np.array([a, b])]


def _log_others(x: Array) -> Array:
    """Return ``log(n - 1)``, minus infinity at n = 1."""
    with np.errstate(divide="ignore"):
        return np.log(np.expm1(x))


def _quadratic(p: Array, x: Array) -> Array:
    return p[0] + x + np.logaddexp(_log_others(x), p[1])


def _quadratic_slopes(p: Array, x: Array) -> Array:
    return np.stack([np.ones_like(x), special.expit(p[1] - _log_others(x))], axis=1)


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


def _power_of(a: float, b: float) -> str:
    return f"{_digits(math.exp(a))} n^{_digits(b)}"


def _digits(value: float) -> str:
    """Return a number with the four digits with which a prediction can be recomputed."""
    return f"{value:.4g}".replace("e+", "e")


def _quadratic_formula(p: Array) -> str:
    c = math.exp(p[1]) - 1.0
    return f"{_digits(math.exp(p[0]))} n (n {'-' if c < 0.0 else '+'} {_digits(abs(c))})"


def _break_formula(p: Array) -> str:
    above = _power_of(p[0] - p[2] * p[3], p[1] + p[2])
    return f"{_power_of(p[0], p[1])} up to n = {_digits(math.exp(p[3]))}, then {above}"


POWER = Curve(
    name="power law",
    n_parameters=2,
    of=_line,
    slopes=_line_slopes,
    begins=_line_begins,
    exponents=lambda p: {"exponent": float(p[1])},
    formula=lambda p: _power_of(*p.tolist()),
)
LOGISTIC = POWER._replace(name="logistic in log n")
QUADRATIC = Curve(
    name="linear to quadratic",
    n_parameters=2,
    of=_quadratic,
    slopes=_quadratic_slopes,
    begins=lambda x, y: [np.array([float((y - 2.0 * x).mean()), start]) for start in (0.0, 3.0)],
    exponents=lambda p: {"c of n (n + c)": float(np.exp(p[1]) - 1.0)},
    formula=_quadratic_formula,
)
FLOOR = Curve(
    name="power law with a floor",
    n_parameters=3,
    of=_with_floor,
    slopes=_floor_slopes,
    begins=_floor_begins,
    exponents=lambda p: {"exponent": float(p[1]), "floor": float(np.exp(p[2]))},
    formula=lambda p: f"{_digits(math.exp(p[2]))} + {_power_of(p[0], p[1])}",
)
BREAK = Curve(
    name="break point",
    n_parameters=4,
    of=_broken,
    slopes=_broken_slopes,
    begins=_broken_begins,
    exponents=lambda p: {
        "exponent below": float(p[1]),
        "exponent above": float(p[1] + p[2]),
        "break": float(np.exp(p[3])),
    },
    formula=_break_formula,
)


class Scale(NamedTuple):
    """A scale on which means are fitted."""

    quantity: str
    """Name of the quantity whose logarithm is fitted."""
    curves: tuple[Curve, ...]
    """Laws, simple ones first."""
    back: Callable[[Array], Array]
    """Return means of fitted values."""
    weight: Callable[[Array], Array]
    """Return the inverse relative variance of a seed at fitted values."""


def _certain(values: Array) -> Array:
    return np.ones_like(values)


def _binomial(logits: Array) -> Array:
    """Return the inverse variance of a logit, relative to that of a rate of one half."""
    return 4.0 * special.expit(logits) * special.expit(-logits)


def _exp(values: Array) -> Array:
    with np.errstate(over="ignore"):
        return np.exp(values)


LOG = Scale("mean", (POWER, QUADRATIC, FLOOR, BREAK), _exp, _certain)
GEOMETRIC = LOG._replace(quantity="geometric mean")
LOGIT = Scale("odds", (LOGISTIC, BREAK), special.expit, _binomial)
DIFFERENCE = Scale("ratio", (LOGISTIC, BREAK), np.array, _certain)


class Sample(NamedTuple):
    """Measurements at several sizes with the same seeds."""

    sizes: Array
    """``(m,)`` in ascending order, 1 or more."""
    values: Array
    """``(n_seeds, m)`` linearized values on the scale, whose mean is fitted."""
    observed: Array
    """``(n_seeds, m)`` the values themselves."""
    censored: BoolArray
    """``(n_seeds, m)`` whether a value is only known to be larger."""
    weights: Array
    """``(m,)`` inverse relative variances of a seed."""
    scale: Scale
    min_noise: float = 0.0
    """Minimum variance of a seed of weight 1, on the scale."""
    bounds: tuple[float, float] = (-math.inf, math.inf)
    """Minimum and maximum of a mean."""

    def first(self, m: int) -> Sample:
        """Return the sample of the m smallest sizes."""
        return self._replace(
            sizes=self.sizes[:m],
            values=self.values[:, :m],
            observed=self.observed[:, :m],
            censored=self.censored[:, :m],
            weights=self.weights[:m],
        )

    @property
    def means(self) -> Array:
        """Means over seeds ``(m,)`` as the table has them; geometric means of censored values."""
        if self.scale is GEOMETRIC:
            return _exp(self.values.mean(axis=0))
        return np.asarray(self.observed.mean(axis=0))


def check_sizes(sizes: Array) -> None:
    """Refuse sizes that are not finite or below 1.

    Raises
    ------
    ValueError
        One line that names the first of them.
    """
    for size in np.atleast_1d(sizes).tolist():
        if not MIN_SIZE <= size < math.inf:
            raise ValueError(f"size = {size:g}, allowed: finite sizes of 1 or more")


def of_numbers(
    sizes: Array, values: Array, bounds: tuple[float, float] = (-math.inf, math.inf)
) -> Sample:
    """Return a sample of numbers ``(n_seeds, m)`` with positive means.

    Raises
    ------
    ValueError
        If a number is not finite, a mean is not positive, or a size is below 1; one line.
    """
    means = _checked_means(sizes, values)
    if not (means > 0.0).all():
        size = sizes[int(np.argmin(means))]
        raise ValueError(f"the mean at size {size:g} is {means.min():.4g}, allowed: positive means")
    linear = np.log(means) + values / means - 1.0
    unseen = np.zeros(values.shape, dtype=bool)
    return Sample(sizes, linear, values, unseen, np.ones(len(sizes)), LOG, bounds=bounds)


def of_times(sizes: Array, values: Array, censored: BoolArray) -> Sample:
    """Return a sample of positive numbers ``(n_seeds, m)``, some of which are censored.

    Raises
    ------
    ValueError
        If a number is not positive and finite, all are censored, or a size is below 1; one line.
    """
    _checked_means(sizes, values)
    if not (values > 0.0).all():
        raise ValueError(f"a time is {values.min():.4g}, allowed: positive times")
    if censored.all():
        raise ValueError(
            f"no run reached the criterion: all are censored, at {values.min():g} decisions or more"
        )
    return Sample(sizes, np.log(values), values, censored, np.ones(len(sizes)), GEOMETRIC)


def of_rates(sizes: Array, rates: Array, episodes: Array | int) -> Sample:
    """Return a sample of success rates ``(n_seeds, m)``, each of so many episodes.

    Raises
    ------
    ValueError
        If a rate is not between 0 and 1, or a size is below 1; one line.
    """
    means = _checked_means(sizes, rates)
    if not ((rates >= 0.0) & (rates <= 1.0)).all():
        raise ValueError("a rate is outside of 0 to 1")
    counts = len(rates) * np.broadcast_to(episodes, means.shape)
    shrunk = (means * counts + 0.5) / (counts + 1.0)  # log odds of 0 and 1 are infinite
    slopes = 1.0 / (shrunk * (1.0 - shrunk))
    logits = special.logit(shrunk)
    values = logits + slopes * (rates - means)
    unseen = np.zeros(values.shape, dtype=bool)
    least = 4.0 / float(np.mean(episodes))
    weights = _binomial(logits)
    return Sample(sizes, values, rates, unseen, weights, LOGIT, least, (0.0, 1.0))


def _checked_means(sizes: Array, values: Array) -> Array:
    """Return the means over seeds ``(m,)``; refuse sizes and values that have no law."""
    check_sizes(sizes)
    if not values.size or not np.isfinite(values).all():
        raise ValueError("a value is missing or not finite")
    return np.asarray(values.mean(axis=0))


def apart(own: Sample, base: Sample) -> Sample:
    """Return the differences from the values of the same seeds at the same sizes, on the scale.

    Influences that act on both alike cancel, so that their law deviates less than either. The
    differences may be negative, and have the laws of log odds.
    """
    both, first, second = np.intersect1d(own.sizes, base.sizes, return_indices=True)
    values = own.values[:, first] - base.values[:, second]
    weights = 1.0 / (1.0 / own.weights[first] + 1.0 / base.weights[second])
    return Sample(
        sizes=both,
        values=values,
        observed=own.observed[:, first] - base.observed[:, second],
        censored=own.censored[:, first] | base.censored[:, second],
        weights=weights / weights[-1],
        scale=DIFFERENCE,
    )


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

    @property
    def seeds(self) -> int:
        """Number of seeds."""
        return len(self.sample.values)

    @property
    def formula(self) -> str:
        """The law as an equation in n."""
        return f"{self.sample.scale.quantity} = {self.curve.formula(self.parameters)}"

    def exponents(self, level: float = 0.95) -> dict[str, Estimate]:
        """Return the meaning of the parameters, with Student intervals of resampled seeds."""
        values = self.curve.exponents(self.parameters)
        each = [self.curve.exponents(p) for p in self.resampled]
        reach = float(special.stdtrit(self.seeds - 1, 0.5 + level / 2.0))
        estimates = {}
        for name, value in values.items():
            half = reach * self._spread(np.array([own[name] for own in each]))
            estimates[name] = Estimate(*map(np.asarray, (value, value - half, value + half)))
        return estimates

    def _spread(self, resampled: Array) -> float:
        """Return a standard error; resampling few seeds underestimates it by a known factor."""
        return float(resampled.std(axis=0, ddof=1)) * math.sqrt(self.seeds / (self.seeds - 1))

    def predict(self, size: float, level: float = 0.9, seeds: int | None = None) -> Estimate:
        """Return the law at a size, with an interval of the mean of so many new seeds there.

        By default they are as many as were fitted. The interval lies within the sample's bounds.
        """
        check_sizes(np.array(size))
        shares = 0.5 - level / 2.0, 0.5 + level / 2.0
        if self.sample.scale is LOGIT:
            rates = self._new_rates(size, seeds or self.seeds)
            low, high = np.quantile(rates, shares, method="inverted_cdf").tolist()
        else:
            known = self.distribution(size, seeds)
            low, high = self.sample.scale.back(np.array([known.quantile(p) for p in shares]))
        value = float(self.curve_at(np.array([size]))[0])
        ends = min(value, float(low)), max(value, float(high))
        return Estimate(*(np.asarray(np.clip(end, *self.sample.bounds)) for end in (value, *ends)))

    def distribution(self, size: float, seeds: int | None = None) -> Mixture:
        """Return the distribution of the mean of new seeds on the scale, centered on the law."""
        return self._distribution(size, self.noise / (seeds or self.seeds))

    def _distribution(self, size: float, noise: float) -> Mixture:
        """Return the distribution of the law and of a mean whose weight of 1 has this variance."""
        x = np.log([size])
        value = self.curve.of(self.parameters, x)
        parts = [
            (self._spread(self._resampled_at(x)) ** 2, self.seeds - 1.0),
            (noise / float(self.sample.scale.weight(value)[0]), self._freedom),
        ]
        left = self._drift(x)
        return _mixed(left.weights, float(value[0]), left.variances + left.shifts**2, parts)

    @property
    def _freedom(self) -> float:
        return (self.seeds - 1.0) * len(self.sample.sizes)

    def _new_rates(self, size: float, seeds: int) -> Array:
        """Return draws of the mean rate of new seeds: binomial, with their effective number."""
        rng = np.random.default_rng(0)
        rates = special.expit(self._distribution(size, 0.0).sample(rng, DRAWS))
        count = max(1, round(4.0 * seeds / self.noise))
        return rng.binomial(count, rates) / count

    def _resampled_at(self, x: Array) -> Array:
        """Return the laws of resampled seeds ``(RESAMPLES,)`` at ``x`` ``(1,)``."""
        return np.array([self.curve.of(p, x)[0] for p in self.resampled])

    def _drift(self, x: Array) -> Drift:
        """Return the possible deviations from the law at ``x`` ``(1,)``."""
        fitted = np.log(self.sample.sizes)
        slopes = self.curve.slopes(self.parameters, np.append(fitted, x))
        noise = self.scatter / self.seeds / self.sample.weights
        return drift(fitted, float(x[0]), self.left, slopes[:-1], slopes[-1], noise)

    def curve_at(self, sizes: Array) -> Array:
        """Return the law's values ``(k,)`` at sizes."""
        return self.sample.scale.back(self.curve.of(self.parameters, np.log(sizes)))


def _mixed(
    weights: Array, mean: float, variances: Array, parts: Sequence[tuple[float, float]]
) -> Mixture:
    """Return a mixture around a mean; each of `parts` is a further variance and its freedom.

    Degrees of freedom of sums are Satterthwaite's (1946).
    """
    total = variances + sum(part for part, _ in parts) + FLAT**2
    lack = sum(part**2 / freedom for part, freedom in parts)
    freedoms = np.minimum(total**2 / (lack + FLAT**6), MOST_FREEDOM)
    return Mixture(weights, np.full_like(total, mean), total, freedoms)


def fit(curve: Curve, sample: Sample, resamples: int = RESAMPLES) -> Law:
    """Fit a curve by weighted least squares, or to censored values by maximum likelihood."""
    x = np.log(sample.sizes)
    values = sample.values
    n_seeds, m = values.shape
    begins = curve.begins(x, values.mean(axis=0))
    parameters = _fitted(curve, sample, values, sample.censored, begins)
    drawn = np.random.default_rng(0).integers(n_seeds, size=(resamples, n_seeds))
    if curve.of is _line and not sample.censored.any():  # all at once
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
        z = left[~seen] / deviation  # mean of a normal distribution beyond the censored value
        hazard = np.exp(-0.5 * z**2 - 0.5 * math.log(2.0 * math.pi) - special.log_ndtr(-z))
        left[~seen] = deviation * hazard
    return Law(curve, sample, parameters, resampled, noise, left.mean(axis=0), scatter)


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
        if curve.of is _line:
            return np.asarray(np.polynomial.polynomial.polyfit(x, means, 1, w=roots))

        def off(p: Array) -> Array:
            return roots * (curve.of(p, x) - means)

        def slopes(p: Array) -> Array:
            return roots[:, None] * curve.slopes(p, x)

        fits = [optimize.least_squares(off, own, slopes) for own in begins]
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


class Contrast(NamedTuple):
    """Difference of the exponents of two laws."""

    difference: Estimate
    p: float
    """P-value of no difference, Student's over seeds."""
    deviation: float
    """Standard deviation of the differences of single seeds."""


def compare(law: Law, base: Law) -> Contrast:
    """Return the difference of the exponents of two power laws of the same seeds and sizes."""
    slopes = [
        np.polyfit(np.log(own.sample.sizes), own.sample.values.T, 1, w=np.sqrt(own.sample.weights))[
            0
        ]
        for own in (law, base)
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
