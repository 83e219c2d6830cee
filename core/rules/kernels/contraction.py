"""The contraction of a sum over all rules with firing strengths, block by block.

A term of a rule base is a tensor theta with one axis per variable. Its value at a state is what is
left when every axis has been contracted with the firing strengths of its variable. Own axes come
first, for every own block that occurs at once (`contract`): the last of them is contracted with
each of its *levels*, the few distinct values that it takes, the others with each own block. The
shared axes follow in `core.rules.kernels.dense`.

Where five functions to a variable are spelled out, it is for the paper's case; the rows of the
preset `paper` that are published have this order of sums.
"""

import numpy as np

from ...numerics import FloatArray, IntArray, njit
from .fuzzy import Layout
from .strengths import hull, negligible, product_of, strengths_of, strengths_room

_FAST = {"reassoc", "contract"}


@njit(cache=True)
def _own_strengths(
    t: int, own: FloatArray, lay: Layout, heads: FloatArray, levels: FloatArray, level: IntArray
) -> int:
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
def contract(
    theta: FloatArray, own: FloatArray, peaks: FloatArray, lay: Layout, partial: FloatArray
) -> None:
    """Contract theta with the strengths of every own block ``(K, n_own)``.

    Writes the weights ``(K, shared rules)`` that remain, term by term. Each row of theta is read
    once, however many own blocks there are. `peaks` ``(d, most memberships)`` are the greatest
    strengths that shared variables will have: what cannot matter stays zero.
    """
    count = len(own)
    start = 0
    level = np.empty(count, np.int64)
    # Room for two blocks, two levels and one head that weigh nothing, to make up round numbers.
    levels = np.empty((count + 2, max(5, lay.counts.max())), theta.dtype)
    for t in range(len(lay.lengths)):
        columns = lay.shared_sizes[t]
        last = lay.own_lengths[t] - 1
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
def _contract_any(
    slab: FloatArray, heads: FloatArray, levels: FloatArray, level: IntArray, out: FloatArray
) -> None:
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
def _add_five(
    slab: FloatArray,
    heads: FloatArray,
    levels: FloatArray,
    level: IntArray,
    peak: FloatArray,
    out: FloatArray,
) -> None:
    """Contract five rows to a head with up to three blocks at once.

    The plain loop makes valuing three states take 1.2 times as long (paired, 5^7 rules).
    """
    bound = _bound(heads)
    least = negligible(slab)
    width = slab.shape[2] // len(peak)
    i = level[0]
    j = level[min(1, len(level) - 1)]
    l = level[min(2, len(level) - 1)]  # noqa: E741
    for p in range(len(slab)):
        if bound[p] <= least:
            continue
        first, last = hull(peak, 0, len(peak), least / bound[p])
        a = heads[0, p]
        b = heads[1, p]
        c = heads[2, p]
        a0 = a * levels[i, 0]
        a1 = a * levels[i, 1]
        a2 = a * levels[i, 2]
        b0 = b * levels[j, 0]
        b1 = b * levels[j, 1]
        b2 = b * levels[j, 2]
        c0 = c * levels[l, 0]
        c1 = c * levels[l, 1]
        c2 = c * levels[l, 2]
        a3 = a * levels[i, 3]
        a4 = a * levels[i, 4]
        b3 = b * levels[j, 3]
        b4 = b * levels[j, 4]
        c3 = c * levels[l, 3]
        c4 = c * levels[l, 4]
        for k in range(np.uint64(first * width), np.uint64(last * width)):
            q = slab[p, 0, k]
            r = slab[p, 1, k]
            s = slab[p, 2, k]
            t = slab[p, 3, k]
            x = slab[p, 4, k]
            out[0, k] += (a0 * q + a1 * r) + (a2 * s + a3 * t) + a4 * x
            out[1, k] += (b0 * q + b1 * r) + (b2 * s + b3 * t) + b4 * x
            out[2, k] += (c0 * q + c1 * r) + (c2 * s + c3 * t) + c4 * x


@njit(cache=True, fastmath=_FAST)
def _blend_and_add(
    slab: FloatArray,
    heads: FloatArray,
    levels: FloatArray,
    level: IntArray,
    n_levels: int,
    peak: FloatArray,
    out: FloatArray,
) -> None:
    """Contract five rows to a head: by level, and then, four heads at a time, by block."""
    outer, _, columns = slab.shape
    bound = _bound(heads)
    least = negligible(slab)
    width = columns // len(peak)
    triples = _triples(level, n_levels)
    blended = np.zeros((4, n_levels + 2, columns), slab.dtype)
    which = np.empty(4, np.int64)
    n = 0
    begin = columns
    end = 0
    for p in range(outer):
        if bound[p] > least:
            first, last = hull(peak, 0, len(peak), least / bound[p])
            begin = min(begin, first * width)
            end = max(end, last * width)
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
            n = 0
            begin = columns
            end = 0


@njit(cache=True, fastmath=_FAST, inline="always")
def _blend_five(
    slab: FloatArray,
    p: int,
    levels: FloatArray,
    v: int,
    out: FloatArray,
    slot: int,
    begin: int,
    end: int,
) -> None:
    """Write the weighted sums of five rows for three levels; the rows are read once.

    The plain loop makes a decision take 1.1 to 1.3 times as long (paired, 5^7 rules, n = 4).
    """
    u = v + 1
    w = v + 2
    a0 = levels[v, 0]
    a1 = levels[v, 1]
    a2 = levels[v, 2]
    a3 = levels[v, 3]
    a4 = levels[v, 4]
    b0 = levels[u, 0]
    b1 = levels[u, 1]
    b2 = levels[u, 2]
    b3 = levels[u, 3]
    b4 = levels[u, 4]
    c0 = levels[w, 0]
    c1 = levels[w, 1]
    c2 = levels[w, 2]
    c3 = levels[w, 3]
    c4 = levels[w, 4]
    for k in range(np.uint64(begin), np.uint64(end)):
        q = slab[p, 0, k]
        r = slab[p, 1, k]
        s = slab[p, 2, k]
        t = slab[p, 3, k]
        x = slab[p, 4, k]
        out[slot, v, k] = (a0 * q + a1 * r) + (a2 * s + a3 * t) + a4 * x
        out[slot, u, k] = (b0 * q + b1 * r) + (b2 * s + b3 * t) + b4 * x
        out[slot, w, k] = (c0 * q + c1 * r) + (c2 * s + c3 * t) + c4 * x


@njit(cache=True, fastmath=_FAST, inline="always")
def _add_four(
    blended: FloatArray,
    v: int,
    heads: FloatArray,
    which: IntArray,
    blocks: IntArray,
    out: FloatArray,
    begin: int,
    end: int,
) -> None:
    """Add four weighted rows of one level to three blocks; the rows are read once."""
    b = blocks[0]
    c = blocks[1]
    d = blocks[2]
    e = which[0]
    f = which[1]
    g = which[2]
    h = which[3]
    b0 = heads[b, e]
    b1 = heads[b, f]
    b2 = heads[b, g]
    b3 = heads[b, h]
    c0 = heads[c, e]
    c1 = heads[c, f]
    c2 = heads[c, g]
    c3 = heads[c, h]
    d0 = heads[d, e]
    d1 = heads[d, f]
    d2 = heads[d, g]
    d3 = heads[d, h]
    for k in range(np.uint64(begin), np.uint64(end)):
        q = blended[0, v, k]
        r = blended[1, v, k]
        s = blended[2, v, k]
        t = blended[3, v, k]
        out[b, k] += (b0 * q + b1 * r) + (b2 * s + b3 * t)
        out[c, k] += (c0 * q + c1 * r) + (c2 * s + c3 * t)
        out[d, k] += (d0 * q + d1 * r) + (d2 * s + d3 * t)


@njit(cache=True)
def _bound(heads: FloatArray) -> FloatArray:
    """Return the greatest of every head among the blocks."""
    out = heads[0].copy()
    for b in range(1, len(heads)):
        row = heads[b]
        for p in range(len(out)):
            out[p] = row[p] if row[p] > out[p] else out[p]
    return out


@njit(cache=True)
def _triples(level: IntArray, n_levels: int) -> IntArray:
    """Return threes ``(g, 3)`` of blocks of one level, made up with blocks K and K + 1."""
    count = len(level)
    n = 0
    triples = np.empty((count, 3), np.int64)
    for v in range(n_levels):
        slot = 0
        for b in range(count):
            if level[b] == v:
                if slot == 0:
                    triples[n, 1] = count
                    triples[n, 2] = count + 1
                    n += 1
                triples[n - 1, slot] = b
                slot = (slot + 1) % 3
    return triples[:n]
