"""Speed-up, efficiency, serial fraction and the universal scalability law.

Let T(N) be the mean time of a task, for example the decisions of an episode, with N robots, N0 the
smallest size and p = N / N0. In *strong scaling* the task stays the same and the speed-up is
``T(N0) / T(N)``. In *weak scaling* the task grows in proportion to the team and the (scaled)
speed-up is ``p * T(N0) / T(N)``. Efficiency is the speed-up divided by p. The serial fraction is
Karp and Flatt's (1990) in strong scaling and Gustafson's (1988) in weak scaling.

The universal scalability law (Gunther 1993) describes the throughput of p workers relative to one,
``C(p) = p / (1 + contention * (p - 1) + coherency * p * (p - 1))``, which has its maximum at
``p = sqrt((1 - contention) / coherency)``. ``p / C(p)`` is linear in its parameters, and so is
``p * T(N)`` in strong and T(N) in weak scaling, so that least squares fit every seed on its own.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from ..results.statistics import Array, Estimate
from .inference import ratio_interval

Scaling = Literal["strong", "weak"]
MIN_SIZES = 3
"""Fewest sizes to which the universal scalability law is fitted."""
ROUNDING = 1e-9
"""Coherency that counts as rounding."""


class Times(NamedTuple):
    """Times of a task by seed and size."""

    sizes: Array
    """``(n_sizes,)`` increasing."""
    values: Array
    """``(n_seeds, n_sizes)`` positive."""
    scaling: Scaling

    @property
    def factors(self) -> Array:
        """Sizes relative to the smallest, ``(n_sizes,)``."""
        return self.sizes / self.sizes[0]


class Speedup(NamedTuple):
    """Speed-up at one size relative to the smallest size."""

    speedup: Estimate
    efficiency: Estimate
    serial_fraction: Estimate | None
    """None at the smallest size."""


class UniversalLaw(NamedTuple):
    """Universal scalability law of one hierarchy."""

    contention: Estimate
    coherency: Estimate
    best_size: Estimate
    """Size of maximum throughput; infinite if the throughput has no maximum."""
    time_at_smallest: float
    """Fitted time at the smallest size."""

    @property
    def is_plausible(self) -> bool:
        """Whether the parameters are in their range, as far as their intervals tell.

        Contention is a share, and coherency is not negative: a speed-up above the number of workers
        has other causes.
        """
        is_shared = float(self.contention.high) >= 0.0 and float(self.contention.value) <= 1.0
        return is_shared and float(self.coherency.high) >= 0.0

    def best_size_within(self, largest: float) -> Estimate | None:
        """Return the size of maximum throughput; None unless it is one of those up to `largest`."""
        is_known = self.is_plausible and np.isfinite(self.best_size.high)
        return self.best_size if is_known and self.best_size.value <= largest else None

    def throughput(self, factors: Array) -> Array:
        """Return the throughput relative to the smallest size at sizes relative to it."""
        contention, coherency = float(self.contention.value), float(self.coherency.value)
        return factors / (
            1.0 + contention * (factors - 1.0) + coherency * factors * (factors - 1.0)
        )


def speedups(times: Times) -> dict[float, Speedup]:
    """Return the speed-up by size.

    Examples
    --------
    >>> halved = Times(np.array([1.0, 2.0]), np.array([[8.0, 4.0], [6.0, 3.0]]), "strong")
    >>> own = speedups(halved)[2.0]
    >>> float(own.speedup.value), float(own.efficiency.value), float(own.serial_fraction.value)
    (2.0, 1.0, 0.0)
    """
    result = {}
    for size, factor, own in zip(times.sizes, times.factors, times.values.T, strict=True):
        ratio = ratio_interval(times.values[:, 0], own)
        scale = float(factor) if times.scaling == "weak" else 1.0
        speedup = Estimate(*(scale * end for end in ratio))
        efficiency = Estimate(*(end / factor for end in speedup))
        fraction = serial_fraction(speedup, float(factor), times.scaling) if factor > 1.0 else None
        result[float(size)] = Speedup(speedup, efficiency, fraction)
    return result


def serial_fraction(speedup: Estimate, factor: float, scaling: Scaling) -> Estimate:
    """Return the serial fraction for a speed-up at `factor` times the smallest size.

    It is negative for a speed-up above `factor`.

    Examples
    --------
    >>> strong = serial_fraction(Estimate(1.6, 1.0, 2.0), 2.0, "strong")
    >>> [round(float(end), 2) for end in strong]
    [0.25, 0.0, 1.0]
    """
    if scaling == "weak":
        value, high, low = ((factor - float(end)) / (factor - 1.0) for end in speedup)
    else:
        value, high, low = (
            ((1.0 / float(end) if end else math.inf) - 1.0 / factor) / (1.0 - 1.0 / factor)
            for end in speedup
        )
    return Estimate(np.asarray(value), np.asarray(low), np.asarray(high))


def fit_universal_law(times: Times) -> UniversalLaw:
    """Fit the universal scalability law by least squares of relative errors.

    Raises
    ------
    ValueError
        If there are fewer than `MIN_SIZES` sizes.
    """
    factors = times.factors
    if len(factors) < MIN_SIZES:
        raise ValueError(f"{len(factors)} sizes: the universal scalability law needs {MIN_SIZES}")
    work = times.values * (factors if times.scaling == "strong" else 1.0)
    terms = np.stack([np.ones_like(factors), factors - 1.0, factors * (factors - 1.0)], axis=1)
    weights = 1.0 / work.mean(axis=0)
    solution = np.linalg.pinv(terms * weights[:, None]) * weights
    constant, linear, quadratic = solution @ work.T
    limits = {"contention": linear, "coherency": quadratic}
    ratios = {name: _signed_ratio(own, constant) for name, own in limits.items()}
    quadratic = np.where(np.abs(quadratic) < ROUNDING * constant, 0.0, quadratic)
    squared = ratio_interval(constant - linear, quadratic)
    best = Estimate(*(times.sizes[0] * np.sqrt(np.maximum(end, 0.0)) for end in squared))
    return UniversalLaw(best_size=best, time_at_smallest=float(constant.mean()), **ratios)


def _signed_ratio(numerator: Array, denominator: Array) -> Estimate:
    """Return the ratio to a clearly positive mean, by Fieller; it may be negative.

    A multiple of the denominator that makes the numerator positive is added and taken off again.
    """
    offset = 1.0 + 2.0 * float(np.abs(numerator).max()) / float(np.abs(denominator.mean()))
    shifted = ratio_interval(numerator + offset * denominator, denominator)
    return Estimate(*(end - offset for end in shifted))
