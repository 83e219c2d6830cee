"""Firing strengths, and the contraction of a sum over all rules with them, block by block.

A term of a rule base is a tensor theta with one axis per variable. Its value at a state is what is
left when every axis has been contracted with the firing strengths of its variable. Own axes come
first, for every own block that occurs at once (`contract`): the last of them is contracted with
each of its *levels*, the few distinct values that it takes, the others with each own block. The
shared axes follow in `core.rules.kernels.dense`.

Innermost loops count without sign: an index that could be negative would be checked at every turn.
Where five functions to a variable are spelled out, it is for the paper's case.
"""

import numpy as np

from ...numerics import FloatArray, njit
from .fuzzy import Layout

NEGLIGIBLE, NEGLIGIBLE_SINGLE = 1e-15, 1e-8
"""Firing strengths below this are left out of sums in which all strengths add up to one; the other
is for weights in single precision. Of the paper's 5^7 rules that is 2e-13 and 1e-6 at most, a fifth
and a tenth of what kernels and their reference implementations may differ by."""

LANES, ROWS = 32, 256
"""Situations side by side: a multiple of the one, and no more than the other at a time."""

FAR, LARGE = 500.0, 1.17191423728026e16
"""Exponents of sigmoids are cut off here; beyond this exponential one is zero to the last bit."""


@njit(cache=True)
def negligible(theta) -> float:  # type: ignore[no-untyped-def]
    """Return the strength that may be left out at the precision of `theta`."""
    return NEGLIGIBLE if theta.itemsize == 8 else NEGLIGIBLE_SINGLE


@njit(cache=True)
def hull(bounds, first, last, least):  # type: ignore[no-untyped-def]
    """Return where the bounds first..last-1 that exceed `least` begin and end."""
    while first < last and bounds[first] <= least:
        first += 1
    while last > first and bounds[last - 1] <= least:
        last -= 1
    return first, last


@njit(cache=True, inline="always")
def _wrapped(j: int, x: float, lay: Layout) -> float:
    period, low = lay.periods[j], lay.lows[j]
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
    lower, upper = k, k + 1
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
def _even_levels(x, last, slope, bound, series, levels):  # type: ignore[no-untyped-def]
    """Write the levels S_k of Eq. 6 after the first, one, and before the last, zero."""
    first = _cut_exponential(-slope * (x - bound))
    for k in range(last):
        power = first * series[k]
        levels[k + 1] = 1.0 / (1.0 + power) if power < LARGE else 0.0


@njit(cache=True, fastmath=_ORDERED)
def _uneven_levels(x, last, slopes, bounds, levels):  # type: ignore[no-untyped-def]
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
    last, x = np.uint64(lay.n_knots[j] - 1), _wrapped(j, x, lay)
    room[0], room[last + 1] = 1.0, 0.0
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
def product_of(term: int, first: int, last: int, lay: Layout, strengths, out) -> None:  # type: ignore[no-untyped-def]
    """Write the products of the strengths of variables first..last-1 of a term, in C order."""
    out[0] = 1.0
    size = 1
    # The last variable first: what is multiplied stands side by side.
    for v in range(last - 1, first - 1, -1):
        j = lay.terms[term, v]
        # From the end, so that no product is overwritten before it is used.
        for s in range(lay.counts[j] - 1, -1, -1):
            strength, part = strengths[j, s], out[s * size : s * size + size]
            for k in range(size):
                part[k] = strength * out[k]
        size *= lay.counts[j]


@njit(cache=True, fastmath=_ORDERED)
def _rise(x, fresh, slope, bound, times, power, rising):  # type: ignore[no-untyped-def]
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
def _fall(level, rising, out):  # type: ignore[no-untyped-def]
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
    m, last, total = lay.counts[j], lay.n_knots[j] - 1, len(values)
    lanes = min(ROWS, (total + LANES - 1) // LANES * LANES)
    x, level, power, rising = np.zeros(lanes), np.empty(lanes), np.empty(lanes), np.empty(lanes)
    strengths = np.empty((m, lanes))
    even = lay.series[j, 0] > 0.0
    for first in range(0, total, lanes):
        n = min(lanes, total - first)
        for i in range(n):
            x[i] = _wrapped(j, values[first + i], lay)
        level[:], strengths[:] = 1.0, 0.0
        for k in range(last):
            fresh, times = k == 0 or not even, lay.series[j, k] if even else 1.0
            _rise(x, fresh, lay.slopes[j, k], lay.bounds[j, k], times, power, rising)
            _fall(level, rising, strengths[k % m])
        for i in range(n):
            strengths[last % m, i] += level[i]
        for s in range(m):
            for i in range(n):
                out[s, first + i] = strengths[s, i]


_FAST = {"reassoc", "contract"}


@njit(cache=True)
def _own_strengths(t: int, own, lay: Layout, heads, levels, level) -> int:  # type: ignore[no-untyped-def]
    """Write the strengths of own variables of a term, the last of them by level.

    `heads` ``(K, outer)`` takes the products over all own variables but the last, `levels` the
    strengths of the last at each level, `level` ``(K,)`` the level of every block. Returns the
    number of levels.
    """
    last = lay.own_lengths[t] - 1
    j = lay.terms[t, max(last, 0)]
    strengths, room = strengths_room(lay)
    n_levels = 0
    for b in range(len(own)):
        for v in range(last):
            other = lay.terms[t, v]
            strengths_of(other, own[b, other], lay, strengths[other], room)
        product_of(t, 0, max(last, 0), lay, strengths, heads[b])
        level[b] = -1
        for earlier in range(b):
            if last < 0 or own[earlier, j] == own[b, j]:
                level[b] = level[earlier]
                break
        if level[b] < 0:
            level[b] = n_levels
            levels[n_levels] = 0.0
            if last < 0:
                levels[n_levels, 0] = 1.0
            else:
                strengths_of(j, own[b, j], lay, strengths[j], room)
                for s in range(lay.counts[j]):
                    levels[n_levels, s] = strengths[j, s]
            n_levels += 1
    return n_levels


@njit(cache=True)
def contract(theta, own, peaks, lay: Layout, partial) -> None:  # type: ignore[no-untyped-def]
    """Contract theta with the strengths of every own block ``(K, n_own)``.

    Writes the weights ``(K, shared rules)`` that remain, term by term. Each row of theta is read
    once, however many own blocks there are. `peaks` ``(d, most memberships)`` are the greatest
    strengths that shared variables will have: what cannot matter stays zero.
    """
    count, start = len(own), 0
    level = np.empty(count, np.int64)
    # Room for two blocks, two levels and one head that weigh nothing, to make up round numbers.
    levels = np.empty((count + 2, max(5, lay.counts.max())), theta.dtype)
    for t in range(len(lay.lengths)):
        columns, last = lay.shared_sizes[t], lay.own_lengths[t] - 1
        m = lay.counts[lay.terms[t, last]] if last >= 0 else 1
        outer = lay.own_sizes[t] // m
        heads = np.zeros((count + 2, outer + 1), theta.dtype)
        n_levels = _own_strengths(t, own, lay, heads, levels, level)
        levels[n_levels:] = 0.0
        slab = theta[lay.offsets[t] : lay.offsets[t + 1]].reshape(outer, m, columns)
        out = np.zeros((count + 2, columns), theta.dtype)
        peak = peaks[max(0, lay.terms[t, last + 1])] if lay.lengths[t] > last + 1 else _WHOLE
        parts = lay.counts[lay.terms[t, last + 1]] if lay.lengths[t] > last + 1 else 1
        # Block by block, a decision takes 1.6 to 2.0 times as long (paired, 5^7 rules, n = 4).
        if m != 5:
            _contract_any(slab, heads, levels, level, out)
        elif count <= 3:
            _add_five(slab, heads, levels, level, peak[:parts], out)
        else:
            _blend_and_add(slab, heads, levels, level, n_levels, peak[:parts], out)
        for b in range(count):
            for k in range(columns):
                partial[b, start + k] = out[b, k]
        start += columns


_WHOLE = np.ones(1)


@njit(cache=True, fastmath=_FAST)
def _contract_any(slab, heads, levels, level, out) -> None:  # type: ignore[no-untyped-def]
    """Contract ``(outer, m, columns)`` block by block."""
    outer, m, columns = slab.shape
    for b in range(len(level)):
        for p in range(outer):
            for s in range(m):
                weight = heads[b, p] * levels[level[b], s]
                if weight > negligible(slab):
                    for k in range(columns):
                        out[b, k] += weight * slab[p, s, k]


@njit(cache=True, fastmath=_FAST)
def _add_five(slab, heads, levels, level, peak, out) -> None:  # type: ignore[no-untyped-def]
    """Contract five rows to a head with up to three blocks at once.

    The plain loop makes valuing three states take 1.2 times as long (paired, 5^7 rules).
    """
    bound, least = _bound(heads), negligible(slab)
    width = slab.shape[2] // len(peak)
    i, j = level[0], level[min(1, len(level) - 1)]
    l = level[min(2, len(level) - 1)]  # noqa: E741
    for p in range(len(slab)):
        if bound[p] <= least:
            continue
        first, last = hull(peak, 0, len(peak), least / bound[p])
        a, b, c = heads[0, p], heads[1, p], heads[2, p]
        a0, a1, a2 = a * levels[i, 0], a * levels[i, 1], a * levels[i, 2]
        b0, b1, b2 = b * levels[j, 0], b * levels[j, 1], b * levels[j, 2]
        c0, c1, c2 = c * levels[l, 0], c * levels[l, 1], c * levels[l, 2]
        a3, a4, b3, b4 = a * levels[i, 3], a * levels[i, 4], b * levels[j, 3], b * levels[j, 4]
        c3, c4 = c * levels[l, 3], c * levels[l, 4]
        for k in range(np.uint64(first * width), np.uint64(last * width)):
            q, r, s = slab[p, 0, k], slab[p, 1, k], slab[p, 2, k]
            t, x = slab[p, 3, k], slab[p, 4, k]
            out[0, k] += (a0 * q + a1 * r) + (a2 * s + a3 * t) + a4 * x
            out[1, k] += (b0 * q + b1 * r) + (b2 * s + b3 * t) + b4 * x
            out[2, k] += (c0 * q + c1 * r) + (c2 * s + c3 * t) + c4 * x


@njit(cache=True, fastmath=_FAST)
def _blend_and_add(slab, heads, levels, level, n_levels, peak, out) -> None:  # type: ignore[no-untyped-def]
    """Contract five rows to a head: by level, and then, four heads at a time, by block."""
    outer, _, columns = slab.shape
    bound, least, width = _bound(heads), negligible(slab), columns // len(peak)
    triples = _triples(level, n_levels)
    blended = np.zeros((4, n_levels + 2, columns), slab.dtype)
    which, n, begin, end = np.empty(4, np.int64), 0, columns, 0
    for p in range(outer):
        if bound[p] > least:
            first, last = hull(peak, 0, len(peak), least / bound[p])
            begin, end = min(begin, first * width), max(end, last * width)
            which[n] = p
            n += 1
        if n == 4 or (p == outer - 1 and n > 0):
            which[n:] = outer
            for slot in range(n):
                for v in range(0, n_levels, 3):
                    _blend_five(slab, which[slot], levels, v, blended, slot, begin, end)
            for g in range(len(triples)):
                v = level[triples[g, 0]]
                _add_four(blended, v, heads, which, triples[g], out, begin, end)
            n, begin, end = 0, columns, 0


@njit(cache=True, fastmath=_FAST, inline="always")
def _blend_five(slab, p, levels, v, out, slot, begin, end):  # type: ignore[no-untyped-def]
    """Write the weighted sums of five rows for three levels; the rows are read once.

    The plain loop makes a decision take 1.1 to 1.3 times as long (paired, 5^7 rules, n = 4).
    """
    u, w = v + 1, v + 2
    a0, a1, a2, a3, a4 = levels[v, 0], levels[v, 1], levels[v, 2], levels[v, 3], levels[v, 4]
    b0, b1, b2, b3, b4 = levels[u, 0], levels[u, 1], levels[u, 2], levels[u, 3], levels[u, 4]
    c0, c1, c2, c3, c4 = levels[w, 0], levels[w, 1], levels[w, 2], levels[w, 3], levels[w, 4]
    for k in range(np.uint64(begin), np.uint64(end)):
        q, r, s = slab[p, 0, k], slab[p, 1, k], slab[p, 2, k]
        t, x = slab[p, 3, k], slab[p, 4, k]
        out[slot, v, k] = (a0 * q + a1 * r) + (a2 * s + a3 * t) + a4 * x
        out[slot, u, k] = (b0 * q + b1 * r) + (b2 * s + b3 * t) + b4 * x
        out[slot, w, k] = (c0 * q + c1 * r) + (c2 * s + c3 * t) + c4 * x


@njit(cache=True, fastmath=_FAST, inline="always")
def _add_four(blended, v, heads, which, blocks, out, begin, end):  # type: ignore[no-untyped-def]
    """Add four weighted rows of one level to three blocks; the rows are read once."""
    b, c, d = blocks[0], blocks[1], blocks[2]
    e, f, g, h = which[0], which[1], which[2], which[3]
    b0, b1, b2, b3 = heads[b, e], heads[b, f], heads[b, g], heads[b, h]
    c0, c1, c2, c3 = heads[c, e], heads[c, f], heads[c, g], heads[c, h]
    d0, d1, d2, d3 = heads[d, e], heads[d, f], heads[d, g], heads[d, h]
    for k in range(np.uint64(begin), np.uint64(end)):
        q, r, s, t = blended[0, v, k], blended[1, v, k], blended[2, v, k], blended[3, v, k]
        out[b, k] += (b0 * q + b1 * r) + (b2 * s + b3 * t)
        out[c, k] += (c0 * q + c1 * r) + (c2 * s + c3 * t)
        out[d, k] += (d0 * q + d1 * r) + (d2 * s + d3 * t)


@njit(cache=True)
def _bound(heads):  # type: ignore[no-untyped-def]
    """Return the greatest of every head among the blocks."""
    out = heads[0].copy()
    for b in range(1, len(heads)):
        row = heads[b]
        for p in range(len(out)):
            out[p] = row[p] if row[p] > out[p] else out[p]
    return out


@njit(cache=True)
def _triples(level, n_levels):  # type: ignore[no-untyped-def]
    """Return threes ``(g, 3)`` of blocks of one level, made up with blocks K and K + 1."""
    count, n = len(level), 0
    triples = np.empty((count, 3), np.int64)
    for v in range(n_levels):
        slot = 0
        for b in range(count):
            if level[b] == v:
                if slot == 0:
                    triples[n, 1], triples[n, 2] = count, count + 1
                    n += 1
                triples[n - 1, slot] = b
                slot = (slot + 1) % 3
    return triples[:n]
