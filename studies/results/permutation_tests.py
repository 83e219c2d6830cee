"""Permutation tests over seeds, and Holm's adjustment of their p.

They assume no distribution and allow the many ties of success rates. The paired test flips the
signs of the differences of n seeds, so its p is a multiple of ``2 ** (1 - n)``: five seeds that all
agree still have p = 0.06.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.numerics import stats
from .statistics import MAX_VALUES, ROUNDING, Array, blocks

LEVEL = 0.05
"""Level of significance: a difference is significant if its adjusted p is below."""


EXACT = 99_999
"""Largest number of permutations that are all tried; of more, this number is drawn."""


class Friedman(NamedTuple):
    """Result of a test of no difference between conditions (Friedman 1937)."""

    statistic: float
    """Friedman's chi square, corrected for ties."""
    p: float
    """p by permutation within seeds."""
    concordance: float
    """Kendall's W: 0 if seeds rank the conditions independently, 1 if all ranks agree."""


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
    spread = (ranks**2).sum() / (k - 1)  # sum of the variances within seeds, reduced by ties
    if spread == 0.0:
        return Friedman(0.0, 1.0, 0.0)
    statistic = float((ranks.sum(axis=0) ** 2).sum() / spread)
    rng = np.random.default_rng(seed)
    sizes = np.diff([*range(0, permutations, 100), permutations])  # 100 fit into the cache
    shuffled = (rng.permuted(np.broadcast_to(ranks, (m, n, k)), axis=2) for m in sizes)
    squares = ((many.sum(axis=1) ** 2).sum(axis=1) / spread for many in shuffled)
    reached = sum(int((some >= statistic - 1e-9).sum()) for some in squares)
    return Friedman(statistic, (1 + reached) / (1 + permutations), statistic / (n * (k - 1)))


def paired_permutation(first: ArrayLike, second: ArrayLike, permutations: int = EXACT) -> float:
    """Return the two-sided p of equal means of paired values ``(n_seeds,)``, by sign flips.

    All ``2 ** n_seeds`` sign patterns are tried if there are at most `permutations`. Sums that
    differ by rounding only are equal, whatever the size of the values.

    Raises
    ------
    ValueError
        If the numbers of values differ, there are none, or one is not finite.

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
    # Differences of whole numbers are exact; others are off by units in the last place.
    is_whole = (one == np.rint(one)) & (other == np.rint(other))
    rounding = np.where(is_whole, 0.0, 2 * np.finfo(float).eps * (abs(one) + abs(other)))
    reaching = _reaching(difference, rounding, _flips(n, permutations))
    if 2**n <= permutations:
        return float(reaching.mean())
    return float((1 + reaching.sum()) / (1 + permutations))


BITS = 8
"""Number of signs of a table of sums; longer patterns add up several tables."""


@lru_cache(maxsize=2)
def _flips(n: int, permutations: int) -> NDArray[np.uint8]:
    """Return patterns of flipped signs as bytes ``(n / BITS, m)``: all, or randomly drawn ones.

    They are drawn in blocks, because all signs of a thousand seeds would take a gigabyte.
    """
    parts = -(-n // BITS)
    if 2**n <= permutations:
        return np.arange(2**n, dtype="<u4").view(np.uint8).reshape(-1, 4)[:, :parts].T.copy()
    numbers = np.empty((parts, permutations), dtype=np.uint8)
    rng = np.random.default_rng(0)
    for rows in blocks(permutations, n):
        # The highest bit is what `integers(0, 2)` returns, seven times faster.
        drawn = rng.integers(2**32, size=(rows.stop - rows.start, n), dtype=np.uint32)
        numbers[:, rows] = np.packbits(drawn < 2**31, axis=1, bitorder="little").T
    return numbers


def _reaching(difference: Array, rounding: Array, flipped: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which patterns of flipped signs, see `_flips`, reach the sum S >= 0 of differences.

    If the flipped differences add up to F, the sum of a pattern is S - 2 F. Its magnitude is S or
    more if F <= 0, or if the sum of the others, S - F, is. Each is a sum over its own differences
    only, so that a large value on the other side hides no digits.
    """
    n = difference.size
    rounding = rounding + n * np.finfo(float).eps * abs(difference) * (rounding > 0.0)
    both = np.zeros((2, len(flipped) * BITS))
    both[:, :n] = difference, rounding
    patterns = np.arange(2**BITS)[:, None] >> np.arange(BITS) & 1
    sums = (both.reshape(2, -1, BITS) @ patterns.T).swapaxes(0, 1)
    moved = np.zeros((2, flipped.shape[1]))
    left = np.zeros_like(moved)
    for table, numbers in zip(sums, flipped, strict=True):
        moved += table.take(numbers, axis=1)
        left += table.take(2**BITS - 1 - numbers, axis=1)
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
"""Number of runs above which fewer permutations of labels are drawn."""


SPARSE_PERMUTATIONS = 9999
"""Number of permutations of labels for more than `MANY_RUNS` runs."""


def independent_permutation(first: ArrayLike, second: ArrayLike) -> float:
    """Return the two-sided p of equal means of two independent samples, by permutation of labels.

    All permutations are tried if there are at most `EXACT`. The result does not depend on the
    order of the values, and differences that differ by rounding only are equal.

    Examples
    --------
    >>> round(independent_permutation([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), 3)
    0.1
    """
    samples = np.sort(np.asarray(first, float)), np.sort(np.asarray(second, float))
    n_runs = sum(map(len, samples))
    n_permutations = EXACT if n_runs <= MANY_RUNS else SPARSE_PERMUTATIONS
    result = stats.permutation_test(
        samples,
        lambda a, b, axis: a.mean(axis=axis) - b.mean(axis=axis),
        permutation_type="independent",
        vectorized=True,
        n_resamples=n_permutations,
        batch=max(1, MAX_VALUES // n_runs),
        rng=np.random.default_rng(0),
    )
    # SciPy's tolerance of ties does not grow with the values, but their rounding does.
    rounding = ROUNDING * max(float(abs(own).max()) for own in samples)
    others = result.null_distribution
    is_exact = comb(n_runs, len(samples[0])) <= n_permutations
    observed = 0 if is_exact else 1
    reached = [
        (others >= result.statistic - rounding).sum(),
        (others <= result.statistic + rounding).sum(),
    ]
    return min(1.0, 2.0 * float(min(reached) + observed) / (len(others) + observed))


def paired_tests(pairs: Sequence[tuple[Array, Array]]) -> list[tuple[float, float]]:
    """Return the p of each `paired_permutation`, unadjusted and adjusted by `holm`."""
    raw = [paired_permutation(own, base) for own, base in pairs]
    return list(zip(raw, map(float, holm(raw)), strict=True))
