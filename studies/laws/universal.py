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

from ...core.numerics import pd
from ..results.statistics import Array, Estimate, exactly
from .inference import ratio_interval

Scaling = Literal["strong", "weak"]
MIN_SIZES = 3
"""Fewest sizes to which the universal scalability law is fitted."""
ROUNDING = 1e-9
"""Coherency that counts as rounding."""


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


def speedups(times: pd.DataFrame, scaling: Scaling) -> dict[float, dict[str, Estimate]]:
    """Return by size speed-up, efficiency and, above the smallest size, serial fraction.

    Parameters
    ----------
    times
        Positive times of a task: a row for each seed, a column for each size, sizes increasing.
    scaling
        Whether the task stays the same or grows with the team.

    Examples
    --------
    >>> halved = pd.DataFrame({1.0: [8.0, 6.0], 2.0: [4.0, 3.0]})
    >>> {name: float(own.value) for name, own in speedups(halved, "strong")[2.0].items()}
    {'speed-up': 2.0, 'efficiency': 1.0, 'serial fraction': 0.0}
    """
    (first, base), *_ = times.items()
    result = {}
    for size, own in times.items():
        factor = float(size / first)
        is_first = size == first
        ratio = exactly(1.0) if is_first else ratio_interval(base.to_numpy(), own.to_numpy())
        speedup = Estimate(*(end * (factor if scaling == "weak" else 1.0) for end in ratio))
        result[float(size)] = {
            "speed-up": speedup,
            "efficiency": Estimate(*(end / factor for end in speedup)),
        }
        if factor > 1.0:
            result[float(size)]["serial fraction"] = serial_fraction(speedup, factor, scaling)
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


def fit_universal_law(times: pd.DataFrame, scaling: Scaling) -> UniversalLaw:
    """Fit the universal scalability law to times, see `speedups`, by relative least squares.

    Raises
    ------
    ValueError
        If there are fewer than `MIN_SIZES` sizes.
    """
    factors = relative_sizes(times)
    if len(factors) < MIN_SIZES:
        raise ValueError(f"{len(factors)} sizes: the universal scalability law needs {MIN_SIZES}")
    work = times.to_numpy() * (factors if scaling == "strong" else 1.0)
    terms = np.stack([np.ones_like(factors), factors - 1.0, factors * (factors - 1.0)], axis=1)
    weights = 1.0 / work.mean(axis=0)
    constant, linear, quadratic = np.linalg.pinv(terms * weights[:, None]) * weights @ work.T
    contention, coherency = (_signed_ratio(own, constant) for own in (linear, quadratic))
    quadratic = np.where(np.abs(quadratic) < ROUNDING * constant, 0.0, quadratic)
    squared = ratio_interval(constant - linear, quadratic)
    best = Estimate(*(times.columns[0] * np.sqrt(np.maximum(end, 0.0)) for end in squared))
    return UniversalLaw(contention, coherency, best, float(constant.mean()))


def relative_sizes(times: pd.DataFrame) -> Array:
    """Return the sizes of `speedups` relative to the smallest ``(n_sizes,)``."""
    return times.columns.to_numpy(dtype=float) / times.columns[0]


def _signed_ratio(numerator: Array, denominator: Array) -> Estimate:
    """Return the ratio to a clearly positive mean, by Fieller; it may be negative.

    A multiple of the denominator that makes the numerator positive is added and taken off again.
    """
    offset = 1.0 + 2.0 * float(np.abs(numerator).max()) / float(np.abs(denominator.mean()))
    shifted = ratio_interval(numerator + offset * denominator, denominator)
    return Estimate(*(end - offset for end in shifted))
