"""Firing strengths of one state, variable by variable, and their products over a term."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..arrays import FloatArray
from .layout import Layout

NEGLIGIBLE = 1e-17
"""Firing strengths below this are left out of sums in which all strengths add up to one."""

FLAT = 37.0
"""Beyond this exponent a sigmoid is zero or one to the last bit of a strength."""


@njit(cache=True)
def _wrapped(j: int, x: float, lay: Layout) -> float:
    period, low = lay.periods[j], lay.lows[j]
    if period > 0.0 and not low <= x < low + period:
        x -= period * np.floor((x - low) / period)
    return x


@njit(cache=True)
def pair(j: int, x: float, lay: Layout) -> tuple[int, int, float]:
    """Return the two neighbouring triangular functions (lower, upper) and the upper's strength."""
    x = _wrapped(j, x, lay)
    m = lay.counts[j]
    knots = lay.knots[j]
    # On a circle x lies between the last centre of the left copy and the first of the right one.
    first, last = (m - 1, 2 * m - 1) if lay.periods[j] > 0.0 else (0, m - 2)
    k = first
    while k < last and x >= knots[k + 1]:
        k += 1
    share = min(max((x - knots[k]) / (knots[k + 1] - knots[k]), 0.0), 1.0)
    lower, upper = k, k + 1
    if lower >= m:
        lower -= m
    if upper >= m:
        upper -= m
    if upper >= m:
        upper -= m
    return lower, upper, share


@njit(cache=True)
def strengths_of(j: int, x: float, lay: Layout, out: FloatArray) -> None:
    """Write the firing strengths of variable j at x into ``out[:counts[j]]``."""
    m = lay.counts[j]
    for k in range(m):
        out[k] = 0.0
    if not lay.sigmoid:
        low, high, share = pair(j, x, lay)
        out[low] += 1.0 - share
        out[high] += share
        return
    x = _wrapped(j, x, lay)
    last = lay.n_knots[j] - 1
    bounds, slopes = lay.bounds[j], lay.slopes[j]
    # Evenly spread centres share one slope: the exponentials form a geometric series.
    even, growth = lay.growths[j] > 0.0, lay.growths[j]
    level, power = 1.0, -1.0
    at = 0
    for k in range(last):
        exponent = -slopes[k] * (x - bounds[k])
        rising = 0.0
        if exponent < -FLAT:
            rising = 1.0
        elif exponent < FLAT:
            power = power * growth if even and power > 0.0 else np.exp(exponent)
            rising = 1.0 / (1.0 + power)
        if rising > level:
            rising = level
        out[at] += level - rising
        level = rising
        at = at + 1 if at + 1 < m else 0
    out[at] += level


@njit(cache=True)
def product_of(term: int, first: int, last: int, lay: Layout, strengths, out, start: int) -> None:  # type: ignore[no-untyped-def]
    """Write the products of the strengths of variables first..last-1 of a term, in C order."""
    room = out[start:]
    room[0] = 1.0
    size = 1
    for v in range(first, last):
        j = lay.terms[term, v]
        m = lay.counts[j]
        row = strengths[j, :m]
        # From the end, so that no product is overwritten before it is used.
        for r in range(size - 1, -1, -1):
            base = room[r]
            part = room[r * m : r * m + m]
            for k in range(m):
                part[k] = base * row[k]
        size *= m
