"""Contraction of a sum over all rules, one block of variables after the other.

A term of a rule base is a tensor theta with one axis per variable. Its value at a state is what is
left when every axis has been contracted with the firing strengths of its variable. Own axes come
first, for every own block that occurs at once (`contract`): the last of them is contracted with
each of its *levels*, the few distinct values that it takes, the others with each own block. The
shared axes follow in `core.rules.kernels.dense`.

Innermost loops count without sign: an index that could be negative would be checked at every turn.
Where five functions to a variable are spelled out, it is for the paper's case.
"""

import numpy as np

from ...numerics import njit
from .layout import Layout
from .strengths import hull, negligible, product_of, strengths_of, strengths_room

_FAST = {"reassoc", "contract"}


@njit(cache=True)
def total_width(lay: Layout) -> int:
    """Return how many weights of shared rules all terms leave."""
    return lay.shared_sizes.sum()


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
                levels[n_levels, : lay.counts[j]] = strengths[j, : lay.counts[j]]
            n_levels += 1
    return n_levels


@njit(cache=True)
def contract(theta, own, peaks, lay: Layout, partial) -> None:  # type: ignore[no-untyped-def]
    """Contract theta with the strengths of every own block ``(K, n_own)``.

    Writes the weights ``(K, total_width)`` that remain for the shared rules, term by term. Each row
    of theta is read once, however many own blocks there are. `peaks` ``(d, most memberships)`` are
    the greatest strengths that shared variables will have: what cannot matter stays zero.
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
        partial[:, start : start + columns] = out[:count]
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
