"""Intervals over seeds for means, for ratios of means, and for points where a difference is zero.

All functions take one value per seed, because seeds are the independent units of a study, and
return Student intervals. The interval of a ratio is Fieller's (1954): the set of ratios r for which
the mean of ``numerator - r * denominator`` does not differ significantly from zero. Its upper end
is infinite if the denominator does not differ significantly from zero.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...core.numerics import special
from ..results.statistics import Array, Estimate

LEVEL = 0.95
"""Confidence level of all intervals."""
GRID_POINTS = 2001
"""Points at which an interpolated difference is tested."""


def student_quantile(n_seeds: int) -> float:
    """Return the two-sided quantile of Student's distribution for a mean over seeds."""
    return float(special.stdtrit(n_seeds - 1, 0.5 + LEVEL / 2.0))


def mean_interval(values: Array) -> Estimate:
    """Return the mean of ``(n_seeds,)`` values with its Student interval.

    One seed has no interval: both ends are NaN.

    Examples
    --------
    >>> estimate = mean_interval(np.array([1.0, 2.0, 3.0]))
    >>> float(estimate.value), round(float(estimate.high), 3)
    (2.0, 4.484)
    """
    n_seeds = len(values)
    value = float(np.mean(values))
    if n_seeds < 2:
        return _estimate(value, math.nan, math.nan)
    half = student_quantile(n_seeds) * float(np.std(values, ddof=1)) / math.sqrt(n_seeds)
    return _estimate(value, value - half, value + half)


def ratio_interval(numerator: Array, denominator: Array) -> Estimate:
    """Return the positive ratio of two means over the same seeds with its Fieller interval.

    Parameters
    ----------
    numerator, denominator
        ``(n_seeds,)`` values, paired by seed; the numerator's mean is positive.

    Returns
    -------
    Estimate
        The ratio and its interval within ``[0, inf]``. The ratio is infinite if the denominator's
        mean is not positive.

    Examples
    --------
    >>> estimate = ratio_interval(np.array([2.0, 2.2, 1.8]), np.array([1.0, 1.0, 1.0]))
    >>> round(float(estimate.value), 3), round(float(estimate.low), 3)
    (2.0, 1.503)
    """
    n_seeds = len(numerator)
    top, bottom = float(np.mean(numerator)), float(np.mean(denominator))
    value = top / bottom if bottom > 0.0 else math.inf
    if n_seeds < 2:
        return _estimate(value, math.nan, math.nan)
    covariance = np.cov(numerator, denominator) / n_seeds * student_quantile(n_seeds) ** 2
    square = bottom**2 - float(covariance[1, 1])
    linear = top * bottom - float(covariance[0, 1])
    constant = top**2 - float(covariance[0, 0])
    return _estimate(value, *_positive_solutions(square, linear, constant))


def _positive_solutions(square: float, linear: float, constant: float) -> tuple[float, float]:
    """Return the ends of the r >= 0 with ``square * r**2 - 2 * linear * r + constant <= 0``.

    Where these are two regions, the ends enclose both.
    """
    discriminant = linear**2 - square * constant
    if square > 0.0:
        root = math.sqrt(max(discriminant, 0.0))
        return max(0.0, (linear - root) / square), max(0.0, (linear + root) / square)
    if constant <= 0.0 or discriminant < 0.0:
        return 0.0, math.inf
    divisors = [linear + sign * math.sqrt(discriminant) for sign in (1.0, -1.0)]
    return min((constant / d for d in divisors if d > 0.0), default=math.inf), math.inf


def sign_change(sizes: Sequence[float], differences: Array) -> Estimate | None:
    """Return the size from which on the mean difference is positive, or None if there is none.

    Between measured sizes the differences are interpolated on a logarithmic scale. The interval
    consists of the sizes around the sign change at which the interpolated mean does not differ
    significantly from zero. There is a sign change only if the difference is significantly positive
    at the largest size and not positive at a smaller one. Sizes at which all seeds are equal do not
    count: nothing differs there, as between a chain and a star of two agents.

    Parameters
    ----------
    sizes
        ``(n_sizes,)`` increasing sizes.
    differences
        ``(n_seeds, n_sizes)`` differences of paired seeds.
    """
    differs = differences.any(axis=0)
    differences = differences[:, differs]
    positions = np.log(np.asarray(sizes, dtype=float)[differs])
    if len(positions) < 2:
        return None
    means = differences.mean(axis=0)
    at_end = mean_interval(differences[:, -1])
    not_positive = np.flatnonzero(means <= 0.0)
    if not float(at_end.low) > 0.0 or not len(not_positive):
        return None
    last = int(not_positive[-1])
    share = -means[last] / (means[last + 1] - means[last])
    crossing = positions[last] + share * (positions[last + 1] - positions[last])
    grid = np.union1d(np.linspace(positions[0], positions[-1], GRID_POINTS), crossing)
    weights = np.array([np.interp(grid, positions, unit) for unit in np.eye(len(positions))])
    interpolated = differences @ weights
    error = interpolated.std(axis=0, ddof=1) / math.sqrt(len(differences))
    undecided = np.abs(interpolated.mean(axis=0)) <= student_quantile(len(differences)) * error
    place = int(np.searchsorted(grid, crossing))
    undecided[place] = True
    decided_below = np.flatnonzero(~undecided[:place])
    decided_above = np.flatnonzero(~undecided[place:])
    low = grid[decided_below[-1] + 1] if len(decided_below) else grid[0]
    high = grid[place + decided_above[0] - 1]
    return _estimate(*np.exp([crossing, low, high]).tolist())


def _estimate(value: float, low: float, high: float) -> Estimate:
    return Estimate(np.asarray(value), np.asarray(low), np.asarray(high))
