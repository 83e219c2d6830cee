"""Tests of conditions that met the same worlds: rows are seeds, columns are conditions.

All are permutation tests: they need no distribution, and bear the many ties of success rates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.plugins.deferred import stats

Array = NDArray[np.float64]

LEVEL = 0.05
"""What p must stay below for a difference to be called one."""
EXACT = 99_999
"""Up to so many patterns of signs are all tried; beyond, as many are drawn."""


@dataclass(frozen=True)
class Friedman:
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
    shuffled = (rng.permuted(ranks, axis=1).sum(axis=0) for _ in range(permutations))
    reached = sum(float((sums**2).sum() / spread) >= statistic - 1e-9 for sums in shuffled)
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
    one, other = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if one.ndim != 1 or one.shape != other.shape or not len(one):
        raise ValueError(
            f"paired_permutation: values of shape {one.shape} against {other.shape}, allowed: one "
            "for each seed, as many on both sides"
        )
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise ValueError("paired_permutation: values must be finite")
    difference, n = one - other, len(one)
    if difference.sum() < 0.0:
        difference = -difference
    # Whole numbers differ exactly; others are off by rounding, some units in the last place each.
    is_whole = (one == np.rint(one)) & (other == np.rint(other))
    rounding = np.where(is_whole, 0.0, 2 * np.finfo(float).eps * (abs(one) + abs(other)))
    if 2**n <= permutations:
        flipped = (np.arange(2**n)[:, None] >> np.arange(n) & 1) == 1
        return float(_reaching(difference, rounding, flipped).mean())
    flipped = np.random.default_rng(seed).integers(0, 2, size=(permutations, n)) == 0
    return float((1 + _reaching(difference, rounding, flipped).sum()) / (1 + permutations))


def _reaching(difference: Array, rounding: Array, flipped: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which patterns of flipped signs ``(m, n)`` reach the sum of the differences, S >= 0.

    With the flipped ones summing up to F, the pattern's sum is S - 2 F: its size is S or more if
    F <= 0, or if what is left, S - F, is. Either is a sum over its own differences alone, so that a
    large value that stays in its place hides nothing.
    """
    n = difference.size
    rounding = rounding + n * np.finfo(float).eps * abs(difference) * (rounding > 0.0)
    return (flipped @ difference <= flipped @ rounding) | (
        ~flipped @ difference <= ~flipped @ rounding
    )


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
