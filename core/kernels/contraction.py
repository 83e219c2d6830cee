"""Contraction of a sum over all rules, one block of variables after the other.

A term of a rule base is a tensor theta with one axis per variable. Its value at a state is what is
left when every axis has been contracted with the firing strengths of its variable. Own axes come
first, for every own block that occurs at once (`contract`): the last of them is contracted with
each of its *levels*, the few distinct values that it takes, the others with each own block. Then
the shared axes, for many situations side by side (`fold`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .layout import Layout
from .strengths import negligible, product_of, strengths_of

LANES = 32
"""Situations side by side."""

_FAST = {"reassoc", "contract"}


@njit(cache=True)
def width_of(columns: int) -> int:
    """Return the room that a row of theta takes in scratch: a whole number of vectors."""
    return (columns + 7) // 8 * 8


@njit(cache=True)
def total_width(lay: Layout) -> int:
    """Return the room that the rows of all terms take."""
    total = 0
    for t in range(len(lay.lengths)):
        total += width_of(lay.shared_sizes[t])
    return total


@njit(cache=True, fastmath=_FAST)
def _blend(rows, stride, weights, out):  # type: ignore[no-untyped-def]
    """Write the weighted sum of rows that begin `stride` apart."""
    n, m = len(out), len(weights)
    if m == 5:  # as everywhere in the paper; all rows at once
        a, b, c, d, e = weights[0], weights[1], weights[2], weights[3], weights[4]
        one, two, three = rows[:n], rows[stride : stride + n], rows[2 * stride : 2 * stride + n]
        four, five = rows[3 * stride : 3 * stride + n], rows[4 * stride : 4 * stride + n]
        for k in range(n):
            out[k] = (a * one[k] + b * two[k]) + (c * three[k] + d * four[k]) + e * five[k]
        return
    for k in range(n):
        out[k] = weights[0] * rows[k]
    for s in range(1, m):
        row, weight = rows[s * stride : s * stride + n], weights[s]
        for k in range(n):
            out[k] += weight * row[k]


@njit(cache=True, fastmath=_FAST)
def _blend_three(rows, stride, weights, out, room, n):  # type: ignore[no-untyped-def]
    """Write three weighted sums of five rows, `room` apart; the rows are read once."""
    one, two, three = rows[:n], rows[stride : stride + n], rows[2 * stride : 2 * stride + n]
    four, five = rows[3 * stride : 3 * stride + n], rows[4 * stride : 4 * stride + n]
    a0, a1, a2, a3, a4 = weights[0, 0], weights[0, 1], weights[0, 2], weights[0, 3], weights[0, 4]
    b0, b1, b2, b3, b4 = weights[1, 0], weights[1, 1], weights[1, 2], weights[1, 3], weights[1, 4]
    c0, c1, c2, c3, c4 = weights[2, 0], weights[2, 1], weights[2, 2], weights[2, 3], weights[2, 4]
    x, y, z = out[:n], out[room : room + n], out[2 * room : 2 * room + n]
    for k in range(n):
        p, q, r, s, t = one[k], two[k], three[k], four[k], five[k]
        x[k] = (a0 * p + a1 * q) + (a2 * r + a3 * s) + a4 * t
        y[k] = (b0 * p + b1 * q) + (b2 * r + b3 * s) + b4 * t
        z[k] = (c0 * p + c1 * q) + (c2 * r + c3 * s) + c4 * t


@njit(cache=True, fastmath=_FAST)
def _add_five(rows, stride, weights, x, y, z):  # type: ignore[no-untyped-def]
    """Add three weighted sums of five rows to x, y and z; the rows are read once."""
    n = len(x)
    one, two, three = rows[:n], rows[stride : stride + n], rows[2 * stride : 2 * stride + n]
    four, five = rows[3 * stride : 3 * stride + n], rows[4 * stride : 4 * stride + n]
    a0, a1, a2, a3, a4 = weights[0, 0], weights[0, 1], weights[0, 2], weights[0, 3], weights[0, 4]
    b0, b1, b2, b3, b4 = weights[1, 0], weights[1, 1], weights[1, 2], weights[1, 3], weights[1, 4]
    c0, c1, c2, c3, c4 = weights[2, 0], weights[2, 1], weights[2, 2], weights[2, 3], weights[2, 4]
    for k in range(n):
        p, q, r, s, t = one[k], two[k], three[k], four[k], five[k]
        x[k] += (a0 * p + a1 * q) + (a2 * r + a3 * s) + a4 * t
        y[k] += (b0 * p + b1 * q) + (b2 * r + b3 * s) + b4 * t
        z[k] += (c0 * p + c1 * q) + (c2 * r + c3 * s) + c4 * t


@njit(cache=True, fastmath=_FAST)
def _add_four(part, rows, room, weights):  # type: ignore[no-untyped-def]
    """Add four weighted rows, `room` apart, to `part`."""
    n = len(part)
    one, two = rows[:n], rows[room : room + n]
    three, four = rows[2 * room : 2 * room + n], rows[3 * room : 3 * room + n]
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    for k in range(n):
        part[k] += (a * one[k] + b * two[k]) + (c * three[k] + d * four[k])


@njit(cache=True, fastmath=_FAST)
def _add_four_to_three(x, y, z, rows, room, a, b, c):  # type: ignore[no-untyped-def]
    """Add three weighted sums of four rows to x, y and z; the rows are read once."""
    n = len(x)
    one, two = rows[:n], rows[room : room + n]
    three, four = rows[2 * room : 2 * room + n], rows[3 * room : 3 * room + n]
    a0, a1, a2, a3 = a[0], a[1], a[2], a[3]
    b0, b1, b2, b3 = b[0], b[1], b[2], b[3]
    c0, c1, c2, c3 = c[0], c[1], c[2], c[3]
    for k in range(n):
        p, q, r, s = one[k], two[k], three[k], four[k]
        x[k] += (a0 * p + a1 * q) + (a2 * r + a3 * s)
        y[k] += (b0 * p + b1 * q) + (b2 * r + b3 * s)
        z[k] += (c0 * p + c1 * q) + (c2 * r + c3 * s)


@njit(cache=True)
def _own_strengths(theta, t, own, lay: Layout, heads, levels, level, strengths) -> int:  # type: ignore[no-untyped-def]
    """Write the strengths of own variables of a term, the last of them by level.

    `heads` ``(K, outer)`` takes the products over all own variables but the last, `levels` the
    strengths of the last at each level, `level` ``(K,)`` the level of every block. Returns the
    number of levels.
    """
    last = lay.own_lengths[t] - 1
    j = lay.terms[t, max(last, 0)]
    n_levels = 0
    levels[:] = 0.0
    for b in range(len(own)):
        for v in range(last):
            strengths_of(lay.terms[t, v], own[b, lay.terms[t, v]], lay, strengths[lay.terms[t, v]])
        product_of(t, 0, max(last, 0), lay, strengths, heads[b], 0)
        level[b] = -1
        for other in range(b):
            if last < 0 or own[other, j] == own[b, j]:
                level[b] = level[other]
                break
        if level[b] < 0:
            level[b] = n_levels
            if last < 0:
                levels[n_levels, 0] = 1.0
            else:
                strengths_of(j, own[b, j], lay, strengths[j])
                levels[n_levels, : lay.counts[j]] = strengths[j, : lay.counts[j]]
            n_levels += 1
    return n_levels


@njit(cache=True)
def contract(theta, own, lay: Layout, partial) -> None:  # type: ignore[no-untyped-def]
    """Contract theta with the strengths of every own block ``(K, n_own)``.

    Writes the weights ``(K, total_width)`` that remain for the shared rules, term by term. Each row
    of theta is read once, however many own blocks there are.
    """
    count = len(own)
    strengths = np.empty((max(1, len(lay.counts)), lay.counts.max()))
    heads = np.zeros((count, (lay.own_sizes.max() + 3) // 4 * 4), theta.dtype)
    levels = np.empty((count + 2, lay.counts.max()), theta.dtype)
    level = np.empty(count, np.int64)
    partial[:] = 0.0
    start = 0
    for t in range(len(lay.lengths)):
        columns, last = lay.shared_sizes[t], lay.own_lengths[t] - 1
        width = width_of(columns)
        m = lay.counts[lay.terms[t, last]] if last >= 0 else 1
        outer = lay.own_sizes[t] // m
        heads[:, outer : (outer + 3) // 4 * 4] = 0.0
        n_levels = _own_strengths(theta, t, own, lay, heads, levels, level, strengths)
        slab = theta[lay.offsets[t] :]
        if m == 5 and count <= 3:
            _contract_few(slab, columns, outer, heads, levels, level, partial, start)
        else:
            _contract_many(
                slab, columns, outer, m, heads, levels, n_levels, level, partial, start
            )  # fmt: skip
        start += width


@njit(cache=True)
def _contract_few(slab, columns, outer, heads, levels, level, partial, start):  # type: ignore[no-untyped-def]
    """Contract with up to three own blocks at once, five rows at a time.

    `partial` comes whole, with the term's `start`: a slice of its columns would be strided.
    """
    count, width, least = len(partial), width_of(columns), negligible(slab)
    spare = np.zeros((2, width), slab.dtype)
    weights = np.zeros((3, 5), slab.dtype)
    for p in range(outer):
        needed = False
        for b in range(count):
            needed = needed or heads[b, p] > least
            for s in range(5):
                weights[b, s] = heads[b, p] * levels[level[b], s]
        if needed:
            at = p * 5 * columns
            # A row may be read on into the next one, where there is one.
            n = width if at + 4 * columns + width <= len(slab) else columns
            _add_five(
                slab[at:], columns, weights, partial[0, start : start + n],
                partial[1, start : start + n] if count > 1 else spare[0, :n],
                partial[2, start : start + n] if count > 2 else spare[1, :n],
            )  # fmt: skip


@njit(cache=True)
def _contract_many(  # type: ignore[no-untyped-def]
    slab, columns, outer, m, heads, levels, n_levels, level, partial, start
):
    """Contract with any number of own blocks: by level first, four heads at a time."""
    count, width, least = len(partial), width_of(columns), negligible(slab)
    order, end = np.argsort(level, kind="mergesort"), start + width
    blended = np.zeros((n_levels + 2, 4 * width), slab.dtype)
    flat, needed = blended.ravel(), np.empty(4)
    for p in range(0, outer, 4):
        for i in range(4):
            needed[i] = 0.0
            for b in range(count):
                needed[i] = max(needed[i], heads[b, p + i])
            if needed[i] > least:
                at = (p + i) * m * columns
                # A row may be read on into the next one, where there is one.
                n = width if at + (m - 1) * columns + width <= len(slab) else columns
                for v in range(0, n_levels, 3):
                    if m == 5 and n_levels - v > 1:
                        to = flat[v * 4 * width + i * width :]
                        _blend_three(slab[at:], columns, levels[v : v + 3], to, 4 * width, n)
                        continue
                    for one in range(v, min(v + 3, n_levels)):
                        to = blended[one, i * width : i * width + n]
                        _blend(slab[at:], columns, levels[one, :m], to)
        if needed.max() <= least:
            continue
        k = 0
        while k < count:
            b = order[k]
            rows, four = blended[level[b]], heads[b, p : p + 4]
            if k + 2 < count and level[order[k + 2]] == level[b]:
                c, d = order[k + 1], order[k + 2]
                _add_four_to_three(
                    partial[b, start:end], partial[c, start:end], partial[d, start:end],
                    rows, width, four, heads[c, p : p + 4], heads[d, p : p + 4],
                )  # fmt: skip
                k += 3
                continue
            if max(max(four[0], four[1]), max(four[2], four[3])) > least:
                _add_four(partial[b, start:end], rows, width, four)
            k += 1


@njit(cache=True, fastmath=_FAST)
def _fold_weights(weights, m, strengths, out, lanes):  # type: ignore[no-untyped-def]
    """Contract the last axis of weights that are the same in all lanes."""
    for i in range(len(weights) // m):
        if m == 5:
            a, b, c = weights[5 * i], weights[5 * i + 1], weights[5 * i + 2]
            d, e = weights[5 * i + 3], weights[5 * i + 4]
            for k in range(lanes):
                out[i * LANES + k] = (
                    (a * strengths[k] + b * strengths[LANES + k])
                    + (c * strengths[2 * LANES + k] + d * strengths[3 * LANES + k])
                    + e * strengths[4 * LANES + k]
                )
            continue
        for k in range(lanes):
            out[i * LANES + k] = weights[i * m] * strengths[k]
        for s in range(1, m):
            weight = weights[i * m + s]
            for k in range(lanes):
                out[i * LANES + k] += weight * strengths[s * LANES + k]


@njit(cache=True, fastmath=_FAST)
def _fold_rows(rows, size, m, strengths, out, lanes):  # type: ignore[no-untyped-def]
    """Contract the last axis of `size` rows of lanes."""
    for i in range(size // m):
        for k in range(lanes):
            out[i * LANES + k] = rows[i * m * LANES + k] * strengths[k]
        for s in range(1, m):
            row = rows[(i * m + s) * LANES : (i * m + s) * LANES + LANES]
            strength = strengths[s * LANES : s * LANES + LANES]
            for k in range(lanes):
                out[i * LANES + k] += row[k] * strength[k]


@njit(cache=True)
def fold(partial, strengths, lay: Layout, one, two, out, lanes) -> None:  # type: ignore[no-untyped-def]
    """Contract what `contract` left for one own block with up to `LANES` shared blocks.

    Parameters
    ----------
    partial
        ``(total_width,)`` weights of the shared rules.
    strengths
        ``(d - n_own, most memberships * LANES)`` of the shared variables, lanes side by side.
    one, two
        Scratch, ``(largest shared size * LANES,)``.
    out
        ``(LANES,)`` the values.
    lanes
        How many are wanted.
    """
    out[:lanes] = 0.0
    start = 0
    for t in range(len(lay.lengths)):
        size, first = lay.shared_sizes[t], lay.own_lengths[t]
        weights = partial[start : start + size]
        start += width_of(size)
        if first == lay.lengths[t]:
            out[:lanes] += weights[0]
            continue
        v = lay.lengths[t] - 1
        j = lay.terms[t, v]
        _fold_weights(weights, lay.counts[j], strengths[j - lay.n_own], one, lanes)
        size //= lay.counts[j]
        while v > first:
            v -= 1
            j = lay.terms[t, v]
            _fold_rows(one, size, lay.counts[j], strengths[j - lay.n_own], two, lanes)
            one, two = two, one
            size //= lay.counts[j]
        for k in range(lanes):
            out[k] += one[k]
