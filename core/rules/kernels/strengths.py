"""Firing strengths of one state or of many, and their products over the variables of a term.

Innermost loops count without sign: an index that could be negative would be checked at every turn.
"""

import numpy as np

from ...numerics import FloatArray, njit
from .fuzzy import Layout

NEGLIGIBLE = 1e-15
"""Firing strengths below this are left out of sums in which all strengths add up to one. Of the
paper's 5^7 rules that is 2e-13 at most, a fifth of what kernels and their reference implementations
may differ by."""
NEGLIGIBLE_SINGLE = 1e-8
"""The same for weights in single precision: 1e-6 at most, a tenth of what they may differ by."""

LANES = 32
"""Situations side by side are a multiple of this."""
ROWS = 256
"""Of more situations only so many are looked at at a time."""

FAR = 500.0
"""Exponents of sigmoids are cut off here."""
LARGE = 1.17191423728026e16
"""Beyond this exponential one a sigmoid is zero to the last bit."""


@njit(cache=True)
def negligible(theta: FloatArray) -> float:
    """Return the strength that may be left out at the precision of `theta`."""
    return NEGLIGIBLE if theta.itemsize == 8 else NEGLIGIBLE_SINGLE


@njit(cache=True)
def hull(bounds: FloatArray, first: int, last: int, least: float) -> tuple[int, int]:
    """Return where the bounds first..last-1 that exceed `least` begin and end."""
    while first < last and bounds[first] <= least:
        first += 1
    while last > first and bounds[last - 1] <= least:
        last -= 1
    return first, last


@njit(cache=True, inline="always")
def _wrapped(j: int, x: float, lay: Layout) -> float:
    period = lay.periods[j]
    low = lay.lows[j]
    if period > 0.0 and not low <= x < low + period:
        x -= period * np.floor((x - low) / period)
    return x


@njit(cache=True, inline="always")
def pair(j: int, x: float, lay: Layout) -> tuple[int, int, float]:
    """Return the two neighbouring triangular functions (lower, upper) and the upper's strength."""
    x = _wrapped(j, x, lay)
    m = lay.counts[j]
    knots = lay.knots  # rows are not taken out: that costs more than what is done with them
    # On a circle x lies between the last centre of the left copy and the first of the right one.
    first, last = (m - 1, 2 * m - 1) if lay.periods[j] > 0.0 else (0, m - 2)
    k = first
    while k < last and x >= knots[j, k + 1]:
        k += 1
    share = min(max((x - knots[j, k]) / (knots[j, k + 1] - knots[j, k]), 0.0), 1.0)
    lower = k
    upper = k + 1
    if lower >= m:
        lower -= m
    if upper >= m:
        upper -= m
    if upper >= m:
        upper -= m
    return lower, upper, share


_POWERS = 2.0 ** np.arange(-1000, 1001)
_ORDERED = {"contract", "nsz"}


@njit(cache=True, fastmath=_ORDERED)
def exponential(x: float) -> float:
    """Return exp(x) to its last bits for -690 <= x <= 690, without a branch or a call."""
    k = np.floor(x * 1.4426950408889634074 + 0.5)
    r = x - k * 6.93147180369123816490e-01 - k * 1.90821492927058770002e-10
    # The Taylor series: its thirteenth term is below 1e-16 where |r| <= ln(2) / 2.
    p = 1.0 / 6227020800.0
    p = 1.0 / 479001600.0 + r * p
    p = 1.0 / 39916800.0 + r * p
    p = 1.0 / 3628800.0 + r * p
    p = 1.0 / 362880.0 + r * p
    p = 1.0 / 40320.0 + r * p
    p = 1.0 / 5040.0 + r * p
    p = 1.0 / 720.0 + r * p
    p = 1.0 / 120.0 + r * p
    p = 1.0 / 24.0 + r * p
    p = 1.0 / 6.0 + r * p
    p = 0.5 + r * p
    p = 1.0 + r * (1.0 + r * p)
    return p * _POWERS[int(k) + 1000]


@njit(cache=True, fastmath=_ORDERED)
def _cut_exponential(x: float) -> float:
    """Return exp(x), or what it is at the nearer of -FAR and FAR."""
    x = x if x < FAR else FAR
    return exponential(x if x > -FAR else -FAR)


@njit(cache=True, fastmath=_ORDERED)
def _even_levels(
    x: float, last: np.uint64, slope: float, bound: float, series: FloatArray, levels: FloatArray
) -> None:
    """Write the levels S_k of Eq. 6 after the first, one, and before the last, zero."""
    first = _cut_exponential(-slope * (x - bound))
    for k in range(last):
        power = first * series[k]
        levels[k + 1] = 1.0 / (1.0 + power) if power < LARGE else 0.0


@njit(cache=True, fastmath=_ORDERED)
def _uneven_levels(
    x: float, last: np.uint64, slopes: FloatArray, bounds: FloatArray, levels: FloatArray
) -> None:
    """Do the same for sigmoids of unequal slope, which cross in their far tails."""
    for k in range(last):
        power = _cut_exponential(-slopes[k] * (x - bounds[k]))
        level = 1.0 / (1.0 + power) if power < LARGE else 0.0
        levels[k + 1] = level if level < levels[k] else levels[k]


@njit(cache=True, inline="always")
def strengths_of(j: int, x: float, lay: Layout, out: FloatArray, room: FloatArray) -> None:
    """Write the firing strengths of variable j at x into ``out[:counts[j]]``.

    `room` is scratch, longer than `lay.bounds` is wide.
    """
    m = np.uint64(lay.counts[j])
    if not lay.sigmoid:
        out[:m] = 0.0
        low, high, share = pair(j, x, lay)
        out[low] += 1.0 - share
        out[high] += share
        return
    last = np.uint64(lay.n_knots[j] - 1)
    x = _wrapped(j, x, lay)
    room[0] = 1.0
    room[last + 1] = 0.0
    if lay.series[j, 0] > 0.0:
        _even_levels(x, last, lay.slopes[j, 0], lay.bounds[j, 0], lay.series[j], room)
    else:
        _uneven_levels(x, last, lay.slopes[j], lay.bounds[j], room)
    for s in range(m):
        out[s] = room[s] - room[s + 1]
    for copy in range(m, last + 1, m):
        for s in range(m):
            out[s] += room[copy + s] - room[copy + s + 1]


@njit(cache=True)
def all_strengths(state: FloatArray, lay: Layout, out: FloatArray, room: FloatArray) -> None:
    """Write the firing strengths ``(d, most memberships)`` of all variables of a state ``(d,)``."""
    for j in range(len(state)):
        strengths_of(j, state[j], lay, out[j], room)


@njit(cache=True)
def strengths_room(lay: Layout) -> tuple[FloatArray, FloatArray]:
    """Return room for the strengths of a state, and for finding them."""
    return np.empty((len(lay.counts), lay.counts.max())), np.empty(lay.bounds.shape[1] + 1)


@njit(cache=True, fastmath=_ORDERED, inline="always")
def product_of(
    term: int, first: int, last: int, lay: Layout, strengths: FloatArray, out: FloatArray
) -> None:
    """Write the products of the strengths of variables first..last-1 of a term, in C order."""
    out[0] = 1.0
    size = 1
    # The last variable first: what is multiplied stands side by side.
    for v in range(last - 1, first - 1, -1):
        j = lay.terms[term, v]
        # From the end, so that no product is overwritten before it is used.
        for s in range(lay.counts[j] - 1, -1, -1):
            strength = strengths[j, s]
            part = out[s * size : s * size + size]
            for k in range(size):
                part[k] = strength * out[k]
        size *= lay.counts[j]


@njit(cache=True, fastmath=_ORDERED)
def _rise(
    x: FloatArray,
    fresh: bool,
    slope: float,
    bound: float,
    times: float,
    power: FloatArray,
    rising: FloatArray,
) -> None:
    """Write by how much the functions up to one are left behind at every x: S_k of Eq. 6.

    `power` takes fresh exponentials, or holds those of which `times` as much is wanted.
    """
    if fresh:
        for i in range(len(x)):
            power[i] = _cut_exponential(-slope * (x[i] - bound))
    for i in range(len(x)):
        other = times * power[i]
        rising[i] = 1.0 / (1.0 + other) if other < LARGE else 0.0


@njit(cache=True, fastmath=_ORDERED)
def _fall(level: FloatArray, rising: FloatArray, out: FloatArray) -> None:
    """Add what lies between two levels, and go down to the lower."""
    for i in range(len(level)):
        lower = rising[i] if rising[i] < level[i] else level[i]
        out[i] += level[i] - lower
        level[i] = lower


@njit(cache=True)
def many_strengths(j: int, values: FloatArray, lay: Layout, out: FloatArray) -> None:
    """Write the firing strengths of variable j at many values ``(R,)`` into ``out[:counts[j]]``.

    What `strengths_of` writes for one, `out` being ``(most memberships, R)``; sigmoids only.
    """
    m = lay.counts[j]
    last = lay.n_knots[j] - 1
    total = len(values)
    lanes = min(ROWS, (total + LANES - 1) // LANES * LANES)
    x = np.zeros(lanes)
    level = np.empty(lanes)
    power = np.empty(lanes)
    rising = np.empty(lanes)
    strengths = np.empty((m, lanes))
    even = lay.series[j, 0] > 0.0
    for first in range(0, total, lanes):
        n = min(lanes, total - first)
        for i in range(n):
            x[i] = _wrapped(j, values[first + i], lay)
        level[:] = 1.0
        strengths[:] = 0.0
        for k in range(last):
            fresh = k == 0 or not even
            times = lay.series[j, k] if even else 1.0
            _rise(x, fresh, lay.slopes[j, k], lay.bounds[j, k], times, power, rising)
            _fall(level, rising, strengths[k % m])
        for i in range(n):
            strengths[last % m, i] += level[i]
        for s in range(m):
            for i in range(n):
                out[s, first + i] = strengths[s, i]
