"""Estimates with intervals, and tests of conditions that met the same worlds.

Intervals are by bootstrap over seeds, or Student's t, and of rates over episodes. The seed is the
unit of sampling: episodes of one run depend on each other, runs do not. Intervals of fewer than two
seeds are not a number rather than of no width. Resamples of few seeds hold too few different
values: below `FEW` seeds intervals of means are Student's.

Tests are of permutations: they need no distribution, and bear the many ties of success rates. The
paired one flips the signs of the differences of n seeds, so its p is a multiple of
``2 ** (1 - n)``: five seeds that all agree still have p = 0.06.
"""

import math
import sys
from collections.abc import Iterator, Sequence
from functools import lru_cache
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.numerics import special, stats
from ...core.plugins.words import expect, expect_each, expect_within, show

Array = NDArray[np.float64]

FEW = 8
"""Below so many seeds a bootstrap interval covers too seldom: of normal values a 95% interval from
2, 3, 4, 5 seeds would cover 51, 74, 87, 92%."""

AT_ONCE = 2**20
"""Values that are resampled at a time, so that memory does not grow with the study; 8 MB."""

NOT_NEGATIVE = (0.0, np.inf)
"""The bounds of times, sizes and numbers of things, see `bootstrap`."""

OPEN_UNIT = (sys.float_info.min, 1.0 - sys.float_info.epsilon)
"""Bounds of a share that is neither 0 nor 1."""
MAX_RESAMPLES = 10_000_000

ALIKE = 2.0
"""Failures that `rate` supposes beside those seen. With seeds of which one in twenty never learns,
and 0.99 succeed of the others' episodes, intervals of 10 to 30 seeds and 10 episodes then cover the
truth in 94 to 97% of simulations, without it in 69 to 75%."""


class Estimate(NamedTuple):
    """A value with the ends of its interval; arrays of equal shape, or of no dimension."""

    value: Array
    low: Array
    high: Array


def exactly(value: ArrayLike) -> Estimate:
    """Return numbers without an interval, as counts are."""
    unknown = np.full(np.shape(value), np.nan)
    return Estimate(np.asarray(value), unknown, unknown)


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
    values: ArrayLike,
    level: float = 0.95,
    resamples: int = 4000,
    seed: int = 0,
    bounds: tuple[float, float] = (-np.inf, np.inf),
) -> Estimate:
    """Return the mean of values of runs with its bootstrap interval.

    Whole runs are resampled. The percentiles lie further out than `level` says, by as much as
    Student's t distribution does and variances of few runs fall short (Hesterberg 2015,
    Section 5.2). Of fewer than `FEW` runs the interval is Student's, which is exact for normal
    values.

    Parameters
    ----------
    values
        ``(n_runs,)`` or ``(n_runs, n_points)``. Points are estimated apart, on the same resamples.
    level
        Coverage of the interval.
    resamples, seed
        Number of resamples, and the seed that draws them.
    bounds
        The least and the greatest value that there can be, beyond which no interval reaches. If
        both are finite and all runs have one of them, the interval is as wide as Wilson's for a
        rate of 0 or 1.

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
    for name, number in {"resamples": resamples, "seed": seed}.items():
        expect("a whole number", Integral, **{name: number})
    expect_within(f"1 to {MAX_RESAMPLES:,}", 1, MAX_RESAMPLES, resamples=resamples)
    expect_within("0 or more", 0, math.inf, seed=seed)
    array = _numbers(values, "values")
    if array.ndim not in (1, 2) or len(array) == 0:
        raise ValueError(
            f"bootstrap: values of shape {array.shape}, allowed (n_runs,) or (n_runs, n_points)"
        )
    n_runs = len(array)
    value = array.copy().T.mean(axis=-1)
    if n_runs < 2:
        return exactly(value)
    if n_runs < FEW:
        reach = special.stdtrit(n_runs - 1, 0.5 + level / 2.0)
        half = reach * np.sqrt(array.var(axis=0, ddof=1) / n_runs)
        low = value - half
        high = value + half
    else:
        drawn = _draw_runs(n_runs, resamples, seed)
        means = []
        # Memory holds next to each other what the mean runs along fastest: with several points all
        # resamples of a run, else the runs of a resample.
        axis = 0 if array.size > n_runs else 1
        for part in np.array_split(drawn, min(resamples, 1 + resamples * array.size // AT_ONCE)):
            means.append(array.take(part if axis else part.T, axis=0).mean(axis=axis))
        tail = _tail(level, n_runs)
        low, high = np.quantile(np.concatenate(means), [tail, 1.0 - tail], axis=0)
    least, greatest = bounds
    low = np.clip(low, *bounds)
    high = np.clip(high, *bounds)
    if np.isfinite(greatest - least):  # the interval ends at the bounds, but is no point there
        z = float(special.ndtri(0.5 + level / 2.0))
        reach = (greatest - least) * z**2 / (n_runs + z**2)
        low = np.where(value >= greatest, np.minimum(low, greatest - reach), low)
        high = np.where(value <= least, np.maximum(high, least + reach), high)
    return Estimate(value, low, high)


@lru_cache(maxsize=1)
def _draw_runs(n_runs: int, resamples: int, seed: int) -> NDArray[Any]:
    """Return the runs ``(resamples, n_runs)`` that resamples are made of.

    In few bytes. They are kept, as the conditions of a study mostly have equally many seeds.
    """
    return draw_runs(np.random.default_rng(seed), n_runs, resamples)


def draw_runs(rng: np.random.Generator, n_runs: int, resamples: int) -> NDArray[Any]:
    """Return ``rng.integers(n_runs, size=(resamples, n_runs))``, drawn in blocks, in few bytes."""
    runs = np.empty((resamples, n_runs), dtype=np.min_scalar_type(n_runs - 1))
    for rows in blocks(resamples, n_runs):
        many = rows.stop - rows.start
        runs[rows] = rng.integers(n_runs, size=(many, n_runs), dtype=np.uint32)
    return runs


def blocks(rows: int, width: int) -> Iterator[slice]:
    """Yield which of some rows are dealt with together, so that they hold `AT_ONCE` values.

    Examples
    --------
    >>> list(blocks(5, AT_ONCE // 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    many = max(1, AT_ONCE // width)
    for begin in range(0, rows, many):
        yield slice(begin, min(begin + many, rows))


def _tail(level: float, n_runs: int) -> float:
    """Return the share of resamples beyond either end of an interval."""
    quantile = float(special.stdtrit(n_runs - 1, 0.5 + level / 2.0))
    return special.ndtr(-quantile * math.sqrt(n_runs / (n_runs - 1)))


def rate(outcomes: ArrayLike, level: float = 0.95) -> Estimate:
    """Return a success rate with its Wilson interval, runs as clusters.

    With one episode a run this is Wilson's score interval (Wilson 1927). With several, the number
    of episodes is divided by the design effect (Kish 1965), ``1 + (n_episodes - 1) r``, where r is
    the correlation of the episodes of a run: how much more the rates of the runs vary than those
    of independent episodes would. A few failures tell little of r: it is estimated as if
    `ALIKE` failures more had been seen, in runs all of whose episodes end alike. So if every
    episode of every run ended the same way, the number of runs is what counts.

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
    alike = 1.0
    if rarer > 0.0 and n_episodes > 1:
        effect = n_episodes * array.mean(axis=1).var(ddof=1) / (p * (1.0 - p))
        alike = (np.clip(effect, 1.0, n_episodes) - 1.0) / (n_episodes - 1)
    alike = (ALIKE + rarer * alike) / (ALIKE + rarer)
    n = array.size / (1.0 + (n_episodes - 1) * alike)
    z = float(special.ndtri(0.5 + level / 2.0))
    centre = (p + z**2 / (2.0 * n)) / (1.0 + z**2 / n)
    half = z / (1.0 + z**2 / n) * np.sqrt(p * (1.0 - p) / n + z**2 / (4.0 * n**2))
    low, high = np.clip([centre - half, centre + half], 0.0, 1.0)
    # At a rate of 0 or 1 one end is the rate itself, but for rounding.
    return Estimate(p, np.minimum(low, p), np.maximum(high, p))


def rates(outcomes: ArrayLike, level: float = 0.95) -> Estimate:
    """Return `rate` of each column of ``(n_runs, n_points)`` outcomes on its own."""
    return stack_estimates([rate(column[:, None], level) for column in np.asarray(outcomes).T])


def stack_estimates(estimates: Sequence[Estimate]) -> Estimate:
    """Return estimates of no dimension as one ``(n,)``."""
    return Estimate(*np.array(estimates, dtype=float).T)


LEVEL = 0.05
"""What p must stay below for a difference to be called one."""
EXACT = 99_999
"""Up to so many patterns of signs are all tried; beyond, as many are drawn."""


class Friedman(NamedTuple):
    """Whether conditions differ at all (Friedman 1937)."""

    statistic: float
    """Friedman's chi square, corrected for ties."""
    p: float
    """By permutation within seeds."""
    concordance: float
    """Kendall's W: 0, seeds rank the conditions independently; 1, all alike."""


def friedman(values: ArrayLike, permutations: int = 9999, seed: int = 0) -> Friedman:
    """Test whether the conditions of ``(n_seeds, n_conditions)`` values differ.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noise = rng.normal(size=(20, 4))
    >>> friedman(noise).p > 0.05, friedman(noise + [0, 0, 0, 2]).p < 0.01
    (True, True)
    """
    array = np.asarray(values, dtype=float)
    n, k = array.shape
    if n < 2 or k < 2:
        raise ValueError(f"friedman: {n} seeds x {k} conditions, allowed: 2 x 2 or more")
    ranks = stats.rankdata(array, axis=1) - (k + 1) / 2
    spread = (ranks**2).sum() / (k - 1)  # per-seed variance summed: what ties leave of the ranks
    if spread == 0.0:
        return Friedman(0.0, 1.0, 0.0)
    statistic = float((ranks.sum(axis=0) ** 2).sum() / spread)
    rng = np.random.default_rng(seed)
    sizes = np.diff([*range(0, permutations, 100), permutations])  # few at once fit into the cache
    shuffled = (rng.permuted(np.broadcast_to(ranks, (m, n, k)), axis=2) for m in sizes)
    squares = ((many.sum(axis=1) ** 2).sum(axis=1) / spread for many in shuffled)
    reached = sum(int((some >= statistic - 1e-9).sum()) for some in squares)
    return Friedman(statistic, (1 + reached) / (1 + permutations), statistic / (n * (k - 1)))


def paired_permutation(
    first: ArrayLike, second: ArrayLike, permutations: int = EXACT, seed: int = 0
) -> float:
    """Return the two-sided p of equal means of paired values ``(n_seeds,)``, by sign flips.

    All ``2 ** n_seeds`` sign patterns are tried if they are no more than `permutations`. Sums that
    differ by no more than rounding are equal, whatever the size of the values.

    Raises
    ------
    ValueError
        If there are not as many values of the one as of the other, none, or one is not finite.

    Examples
    --------
    >>> paired_permutation([1, 2, 3, 4, 5, 6], [0, 1, 2, 3, 4, 5])
    0.03125
    """
    one = np.asarray(first, dtype=float)
    other = np.asarray(second, dtype=float)
    if one.ndim != 1 or one.shape != other.shape or not len(one):
        raise ValueError(
            f"paired_permutation: values of shape {one.shape} against {other.shape}, allowed: one "
            "for each seed, as many on both sides"
        )
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise ValueError("paired_permutation: values must be finite")
    difference = one - other
    n = len(one)
    if difference.sum() < 0.0:
        difference = -difference
    # Whole numbers differ exactly; others are off by rounding, some units in the last place each.
    is_whole = (one == np.rint(one)) & (other == np.rint(other))
    rounding = np.where(is_whole, 0.0, 2 * np.finfo(float).eps * (abs(one) + abs(other)))
    reaching = _reaching(difference, rounding, _flips(n, permutations, seed))
    if 2**n <= permutations:
        return float(reaching.mean())
    return float((1 + reaching.sum()) / (1 + permutations))


BITS = 8
"""Signs of which all patterns are summed up once; longer patterns are put together of these."""


@lru_cache(maxsize=2)
def _flips(n: int, permutations: int, seed: int) -> NDArray[np.uint8]:
    """Return patterns of flipped signs, all of them or so many, as numbers ``(n / BITS, m)``.

    They are drawn in blocks: all signs at once would take a gigabyte for a thousand seeds.
    """
    parts = -(-n // BITS)
    if 2**n <= permutations:
        return np.arange(2**n, dtype="<u4").view(np.uint8).reshape(-1, 4)[:, :parts].T.copy()
    numbers = np.empty((parts, permutations), dtype=np.uint8)
    rng = np.random.default_rng(seed)
    for rows in blocks(permutations, n):
        # The highest bits of these are what `integers(0, 2)` returns, which takes seven times.
        drawn = rng.integers(2**32, size=(rows.stop - rows.start, n), dtype=np.uint32)
        numbers[:, rows] = np.packbits(drawn < 2**31, axis=1, bitorder="little").T
    return numbers


def _reaching(difference: Array, rounding: Array, flipped: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which patterns of flipped signs, see `_flips`, reach the sum of differences, S >= 0.

    With the flipped ones summing up to F, the pattern's sum is S - 2 F: its size is S or more if
    F <= 0, or if what is left, S - F, is. Either is a sum over its own differences alone, so that a
    large value that stays in its place hides nothing.
    """
    n = difference.size
    rounding = rounding + n * np.finfo(float).eps * abs(difference) * (rounding > 0.0)
    both = np.zeros((2, len(flipped) * BITS))
    both[:, :n] = difference, rounding
    patterns = np.arange(2**BITS)[:, None] >> np.arange(BITS) & 1
    sums = (both.reshape(2, -1, BITS) @ patterns.T).swapaxes(0, 1)
    moved = np.zeros((2, flipped.shape[1]))
    left = np.zeros_like(moved)
    for of, numbers in zip(sums, flipped, strict=True):
        moved += of.take(numbers, axis=1)
        left += of.take(2**BITS - 1 - numbers, axis=1)
    return (moved[0] <= moved[1]) | (left[0] <= left[1])


def holm(ps: ArrayLike) -> Array:
    """Return p-values adjusted for their number (Holm 1979).

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).round(3).tolist()
    [0.03, 0.06, 0.06]
    """
    array = np.asarray(ps, dtype=float)
    order = np.argsort(array)
    scaled = array[order] * np.arange(len(array), 0, -1)
    adjusted = np.empty_like(array)
    adjusted[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return adjusted


MANY_RUNS = 100
"""Number of runs beyond which label permutations are sampled more sparsely, to save time."""
SPARSE_PERMUTATIONS = 9999
"""Number of label permutations for more than `MANY_RUNS` runs."""


def independent_permutation(first: ArrayLike, second: ArrayLike, seed: int = 0) -> float:
    """Return the two-sided p of equal means of two independent samples, by permutation of labels.

    All permutations are tried if there are at most `EXACT`. The result does not depend on the
    order of the values.

    Examples
    --------
    >>> round(independent_permutation([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), 3)
    0.1
    """
    samples = np.sort(np.asarray(first, float)), np.sort(np.asarray(second, float))
    n_runs = sum(map(len, samples))
    result = stats.permutation_test(
        samples,
        lambda a, b, axis: a.mean(axis=axis) - b.mean(axis=axis),
        permutation_type="independent",
        vectorized=True,
        n_resamples=EXACT if n_runs <= MANY_RUNS else SPARSE_PERMUTATIONS,
        batch=max(1, AT_ONCE // n_runs),
        rng=np.random.default_rng(seed),
    )
    return float(result.pvalue)


def welch(first: ArrayLike, second: ArrayLike, level: float = 0.95) -> Estimate:
    """Return the difference of the means of two independent samples with Welch's interval.

    Two constant samples differ exactly.

    Examples
    --------
    >>> e = welch([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '3.00 [0.73, 5.27]'
    """
    own, base = np.sort(np.asarray(first, float)), np.sort(np.asarray(second, float))
    value = own.mean() - base.mean()
    if np.ptp(own) == np.ptp(base) == 0.0:
        return Estimate(value, value, value)
    low, high = stats.ttest_ind(own, base, equal_var=False).confidence_interval(level)
    return Estimate(value, np.asarray(low), np.asarray(high))


def paired_tests(pairs: Sequence[tuple[Array, Array]]) -> list[tuple[float, float]]:
    """Return p of each `paired_permutation`, as it is and adjusted over all of them by `holm`."""
    raw = [paired_permutation(own, base) for own, base in pairs]
    return list(zip(raw, map(float, holm(raw)), strict=True))
