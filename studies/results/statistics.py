"""Estimates with intervals over seeds.

The seed is the unit of sampling: episodes of one run depend on each other, runs do not. Intervals
of means are by bootstrap over seeds, or Student's t for few seeds; intervals of rates are Wilson's
with runs as clusters. A single seed has no interval.
"""

import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from numbers import Real
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.numerics import special, stats
from ...core.plugins.words import expect_each, expect_within, show

Array = NDArray[np.float64]

FEW = 8
"""Number of seeds below which intervals of means are Student's, because bootstrap intervals of 95%
from 2, 3, 4, 5 normal values would cover only 51, 74, 87, 92%."""
RESAMPLES = 4000
"""Resamples of the bootstrap of a mean."""
MAX_VALUES = 2**20
"""Number of values that are resampled at a time, 8 MB, so that memory is bounded."""
MAX_KEPT_VALUES = 2**22
"""Maximum number of weights of resamples that are kept for further tables, 32 MB."""
NOT_NEGATIVE = (0.0, np.inf)
"""Bounds of times, sizes and counts, see `bootstrap`."""
OPEN_UNIT = (sys.float_info.min, 1.0 - sys.float_info.epsilon)
"""Bounds of a share that is neither 0 nor 1."""
PRIOR_FAILURES = 2.0
"""Number of failures that `rate` adds to those observed when it estimates the correlation of the
episodes of a run. With seeds of which one in twenty never learns, and success 0.99 otherwise,
intervals of 10 to 30 seeds and 10 episodes then cover the truth in 94 to 97% of simulations, and in
69 to 75% without them."""


ROUNDING = 16.0 * float(np.finfo(float).eps)
"""Difference of two values, relative to the larger one, that may be due to rounding."""


class Estimate(NamedTuple):
    """A value with its interval; arrays of equal shape, or scalars."""

    value: Array
    low: Array
    high: Array


class LowerBound(Estimate):
    """Mean of values of which some are only known to be larger; it has no upper end."""


def censored(mean: Estimate, is_censored: ArrayLike) -> Estimate:
    """Return the mean of values, as a lower bound if some of them are only known to be larger.

    Examples
    --------
    >>> type(censored(bootstrap([2.0, 8.0]), [False, True])).__name__
    'LowerBound'
    """
    return LowerBound(mean.value, mean.low, np.asarray(np.inf)) if np.any(is_censored) else mean


def exactly(value: ArrayLike) -> Estimate:
    """Return values without an interval, such as counts."""
    unknown = np.full(np.shape(value), np.nan)
    return Estimate(np.asarray(value), unknown, unknown)


def plain(value: object) -> object:
    """Return tables and lists of estimates and numbers as JSON has them.

    An estimate is a table of ``value``, ``low`` and ``high``; what is infinite or unknown is None.

    Examples
    --------
    >>> plain({"a": [Estimate(1.0, -np.inf, 2.0)], "b": (3, "c")})
    {'a': [{'value': 1.0, 'low': None, 'high': 2.0}], 'b': [3, 'c']}
    """
    if isinstance(value, Estimate):
        value = {name: float(end) for name, end in zip(Estimate._fields, value, strict=True)}
    if isinstance(value, Mapping):
        return {key: plain(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [plain(own) for own in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _numbers(values: ArrayLike, name: str) -> Array:
    """Return values as an array; refuse everything but finite numbers."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {show(values)}, allowed: numbers in rows") from None
    wrong = ~np.isfinite(array)
    if wrong.any():
        place = np.argwhere(wrong)[0].tolist()
        raise ValueError(f"{name}{place} = {array[wrong][0]}, allowed: finite numbers")
    return array


def bootstrap(
    values: ArrayLike, level: float = 0.95, bounds: tuple[float, float] = (-np.inf, np.inf)
) -> Estimate:
    """Return the mean of runs with its bootstrap interval.

    Whole runs are resampled. The percentiles lie further out than `level`, by as much as Student's
    t distribution does and variances of few runs fall short (Hesterberg 2015, Section 5.2). With
    fewer than `FEW` runs the interval is Student's, which is exact for normal values; equal ones
    have none.

    Parameters
    ----------
    values
        ``(n_runs,)`` or ``(n_runs, n_points)``. All points have the same resamples.
    level
        Coverage of the interval.
    bounds
        Smallest and largest possible value, which limit the interval. If both are finite and all
        runs have one of them, the interval is as wide as Wilson's for a rate of 0 or 1.

    Raises
    ------
    ValueError
        If there are no values, they have another shape, or an argument is not finite or out of
        range.

    Examples
    --------
    >>> e = bootstrap([1.0, 2.0, 3.0, 4.0])
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '2.50 [0.45, 4.55]'
    """
    expect_each("numbers", Real, bounds=bounds)
    if len(bounds) != 2 or not bounds[0] < bounds[1]:
        raise ValueError(f"bounds = {show(list(bounds))}, allowed: two numbers in ascending order")
    expect_within("a number above 0 and below 1", *OPEN_UNIT, level=level)
    array = _numbers(values, "values")
    if array.ndim not in (1, 2) or len(array) == 0:
        raise ValueError(
            f"bootstrap: values of shape {array.shape}, allowed (n_runs,) or (n_runs, n_points)"
        )
    n_runs = len(array)
    value = array.copy().T.mean(axis=-1)
    if n_runs < 2:
        return exactly(value)
    t = float(special.stdtrit(n_runs - 1, 0.5 + level / 2.0))
    if n_runs < FEW:
        half = t * np.sqrt(array.var(axis=0, ddof=1) / n_runs)
        equal = (array == array[0]).all(axis=0)
        inside = (value > bounds[0]) & (value < bounds[1]) | ~np.isfinite(bounds).all()
        half = np.where(equal & inside, np.nan, half)
        low, high = value - half, value + half
    else:
        tail = special.ndtr(-t * math.sqrt(n_runs / (n_runs - 1)))
        deviations = (array - value).T  # so that equal runs have exactly their value
        means = [deviations @ weights.T for weights in resample_weights(n_runs, RESAMPLES)]
        low, high = value + np.quantile(np.concatenate(means, -1), [tail, 1.0 - tail], axis=-1)
    minimum, maximum = bounds
    low = np.clip(low, *bounds)
    high = np.clip(high, *bounds)
    if np.isfinite(maximum - minimum):  # an interval at a bound has a width
        z = float(special.ndtri(0.5 + level / 2.0))
        reach = (maximum - minimum) * z**2 / (n_runs + z**2)
        low = np.where(value >= maximum, np.minimum(low, maximum - reach), low)
        high = np.where(value <= minimum, np.maximum(high, minimum + reach), high)
    return Estimate(value, low, high)


def resample_weights(n_runs: int, count: int, seed: int = 0) -> Iterable[Array]:
    """Return the share of each run in `count` resamples, in blocks ``(m, n_runs)``.

    The product with values is their resampled means: a bootstrap without a copy of the values,
    equal to that of SciPy except for rounding. All tables share the resamples of up to a
    thousand runs.
    """
    is_small = count * n_runs <= MAX_KEPT_VALUES
    return (_kept_weights if is_small else _drawn_weights)(n_runs, count, seed)


@lru_cache(maxsize=4)
def _kept_weights(n_runs: int, count: int, seed: int) -> tuple[Array, ...]:
    return tuple(_drawn_weights(n_runs, count, seed))


def _drawn_weights(n_runs: int, count: int, seed: int) -> Iterator[Array]:
    rng = np.random.default_rng(seed)
    for rows in blocks(count, n_runs):
        m = rows.stop - rows.start
        drawn = rng.integers(n_runs, size=(m, n_runs)) + n_runs * np.arange(m)[:, None]
        yield np.bincount(drawn.ravel(), minlength=m * n_runs).reshape(m, n_runs) / n_runs


def blocks(rows: int, width: int) -> Iterator[slice]:
    """Yield slices of rows that hold `MAX_VALUES` values each.

    Examples
    --------
    >>> list(blocks(5, MAX_VALUES // 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    count = max(1, MAX_VALUES // width)
    for start in range(0, rows, count):
        yield slice(start, min(start + count, rows))


def rate(outcomes: ArrayLike, level: float = 0.95) -> Estimate:
    """Return a success rate with its Wilson interval, runs as clusters.

    With one episode a run this is Wilson's score interval (Wilson 1927). With several, the number
    of episodes is divided by the design effect (Kish 1965), ``1 + (n_episodes - 1) r``, where r is
    the correlation of the episodes of a run. It measures how much more the rates of the runs vary
    than those of independent episodes. Because a few failures say little about r, it is estimated
    with `PRIOR_FAILURES` further failures in runs with equal ends of all episodes. If every episode
    of every run ended the same way, the interval is that of one episode a run.

    Parameters
    ----------
    outcomes
        Zeros and ones, or shares of successes, ``(n_runs, n_episodes)``.
    level
        Coverage of the interval.

    Raises
    ------
    ValueError
        If there are no outcomes, or an outcome or the level is out of range.

    Examples
    --------
    >>> e = rate([[1], [1], [1], [0]])
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '0.75 [0.30, 0.95]'
    """
    array = _numbers(outcomes, "outcomes")
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"outcomes of shape {array.shape}, allowed: (n_runs, n_episodes)")
    wrong = (array < 0.0) | (array > 1.0)
    if wrong.any():
        place = np.argwhere(wrong)[0].tolist()
        raise ValueError(f"outcomes{place} = {array[wrong][0]}, allowed: 0 to 1")
    expect_within("a number above 0 and below 1", *OPEN_UNIT, level=level)
    n_runs, n_episodes = array.shape
    p = array.mean()
    if n_runs < 2:
        return exactly(p)
    rarer = min(array.sum(), array.size - array.sum())
    correlation = 1.0
    if rarer > 0.0 and n_episodes > 1:
        effect = n_episodes * array.mean(axis=1).var(ddof=1) / (p * (1.0 - p))
        correlation = (np.clip(effect, 1.0, n_episodes) - 1.0) / (n_episodes - 1)
    correlation = (PRIOR_FAILURES + rarer * correlation) / (PRIOR_FAILURES + rarer)
    n = array.size / (1.0 + (n_episodes - 1) * correlation)
    z = float(special.ndtri(0.5 + level / 2.0))
    center = (p + z**2 / (2.0 * n)) / (1.0 + z**2 / n)
    half = z / (1.0 + z**2 / n) * np.sqrt(p * (1.0 - p) / n + z**2 / (4.0 * n**2))
    low, high = np.clip([center - half, center + half], 0.0, 1.0)
    # At a rate of 0 or 1 one end is the rate itself, except for rounding.
    return Estimate(p, np.minimum(low, p), np.maximum(high, p))


def rates(outcomes: ArrayLike) -> Estimate:
    """Return the `rate` of each column of outcomes ``(n_runs, n_points)``."""
    return stack_estimates([rate(column[:, None]) for column in np.asarray(outcomes).T])


def is_at_end(estimate: Estimate) -> bool:
    """Return whether a value is an end of its interval and no rate, see `bootstrap`."""
    value, low, high = estimate
    return bool(low < high and value in (low, high) and not 0.0 <= low < high <= 1.0)


def stack_estimates(estimates: Sequence[Estimate]) -> Estimate:
    """Return scalar estimates as one estimate ``(n,)``."""
    return Estimate(*np.array(estimates, dtype=float).T)


def welch(first: ArrayLike, second: ArrayLike) -> Estimate:
    """Return the difference of the means of two independent samples with Welch's interval.

    Two samples that are constant but for rounding errors differ exactly.

    Examples
    --------
    >>> e = welch([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '3.00 [0.73, 5.27]'
    """
    own, base = np.sort(np.asarray(first, float)), np.sort(np.asarray(second, float))
    rounding = ROUNDING * max(*np.abs(own), *np.abs(base))
    value = own.mean() - base.mean()
    value = np.where(np.abs(value) <= rounding, 0.0, value)
    if max(np.ptp(own), np.ptp(base)) <= rounding:
        return Estimate(value, value, value)
    # SciPy's `ttest_ind` warns of a loss of precision if one sample is constant.
    shares = np.array([sample.var(ddof=1) / len(sample) for sample in (own, base)])
    weights = [len(own) - 1, len(base) - 1]
    freedom = shares.sum() ** 2 / (shares**2 / weights).sum()
    half = stats.t.ppf(0.975, freedom) * np.sqrt(shares.sum())
    return Estimate(value, value - half, value + half)


def differ_equally(own: Array, base: Array) -> bool:
    """Return whether all differences of paired values are equal, except for rounding.

    Examples
    --------
    >>> differ_equally(np.array([0.3, 0.6]), np.array([0.1, 0.4]))
    True
    """
    largest = max(float(abs(values).max()) for values in (own, base))
    return bool(np.ptp(own - base) <= ROUNDING * largest)


def tied(own: Array, base: Array) -> list[Array]:
    """Return the ranks of the values of two samples, equal if values differ by rounding only.

    Examples
    --------
    >>> tied(np.array([0.1 + 0.2, 1.0]), np.array([0.3]))
    [array([0., 1.]), array([0.])]
    """
    values = np.concatenate([own, base])
    order = np.argsort(values)
    ascending = values[order]
    is_higher = np.diff(ascending) > ROUNDING * np.maximum(*np.abs([ascending[1:], ascending[:-1]]))
    ranks = np.zeros(len(values))
    ranks[order[1:]] = np.cumsum(is_higher)
    return np.split(ranks, [len(own)])


def cliffs_delta(own: Array, base: Array) -> float:
    """Return Cliff's delta (1993): the probability of a higher value minus that of a lower one.

    It is computed from the ranks of the values of both samples, ``(n_runs,)`` each.

    Examples
    --------
    >>> cliffs_delta(np.array([1.0, 3.0]), np.array([0.0, 1.0]))
    0.75
    """
    n_pairs = len(own) * len(base)
    ranks = stats.rankdata(np.concatenate(tied(own, base)))[: len(own)]
    wins = float(ranks.sum()) - len(own) * (len(own) + 1) / 2.0  # Mann and Whitney's U
    return (2.0 * wins - n_pairs) / n_pairs


PROBABILITY_RESAMPLES = 2000
"""Resamples of a probability of a higher value."""


def probability_higher(pairs: Sequence[tuple[Array, Array]]) -> Estimate:
    """Return the probability that a run scores higher than one of the reference, ties half.

    It is the mean of Mann and Whitney's U over tasks, divided by the number of pairs of runs
    (Agarwal et al. 2021). The interval of 95% has the percentiles of runs resampled within
    tasks. At 0 and 1 it is as wide as Wilson's for the smaller number of runs.

    Parameters
    ----------
    pairs
        Scores ``(n_runs,)`` of the condition and of the reference, by task.

    Examples
    --------
    >>> float(probability_higher([(np.array([1.0, 3.0]), np.array([0.0, 1.0]))]).value)
    0.875
    """
    drawn = np.zeros(PROBABILITY_RESAMPLES)
    for task, pair in enumerate(pairs):
        own, base = tied(*pair)
        order = np.argsort(base)
        lower, not_higher = (
            np.searchsorted(base, own, side, sorter=order) for side in ("left", "right")
        )
        weights, base_weights = (
            np.concatenate([*resample_weights(n_runs, PROBABILITY_RESAMPLES, seed)])
            for seed, n_runs in enumerate((len(own), len(base)), 2 * task)
        )
        for rows in blocks(PROBABILITY_RESAMPLES, len(own) + len(base)):
            below = np.pad(np.cumsum(base_weights[rows][:, order], axis=1), ((0, 0), (1, 0)))
            won = 0.5 * (below.take(lower, axis=1) + below.take(not_higher, axis=1))
            drawn[rows] += np.einsum("rk,rk->r", weights[rows], won) / len(pairs)
    each = np.array([0.5 + 0.5 * cliffs_delta(own, base) for own, base in pairs])
    value = np.asarray(each.mean())
    low, high = np.quantile(drawn, [0.025, 0.975])
    z = float(special.ndtri(0.975))
    n_runs = sum(min(len(own), len(base)) for own, base in pairs)
    reach = z**2 / (n_runs + z**2)  # as Wilson's at 0 and 1
    low = min(low, 1.0 - reach) if value == 1.0 else low
    high = max(high, reach) if value == 0.0 else high
    return Estimate(value, low, high)
