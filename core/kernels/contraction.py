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
def _add_four(part, rows, weights):  # type: ignore[no-untyped-def]
    """Add four weighted rows to `part`."""
    n = len(part)
    one, two, three, four = rows[:n], rows[n : 2 * n], rows[2 * n : 3 * n], rows[3 * n :]
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    for k in range(n):
        part[k] += (a * one[k] + b * two[k]) + (c * three[k] + d * four[k])


@njit(cache=True)
def contract(theta, own, lay: Layout, partial) -> None:  # type: ignore[no-untyped-def]
    """Contract theta with the strengths of every own block ``(K, n_own)``.

    Writes the weights ``(K, total_width)`` that remain for the shared rules, term by term. Each row
    of theta is read once, however many own blocks there are.
    """
    count, least = len(own), negligible(theta)
    strengths = np.empty((max(1, len(lay.counts)), lay.counts.max()))
    heads = np.zeros((count, (lay.own_sizes.max() + 3) // 4 * 4), theta.dtype)
    levels = np.empty((count, lay.counts.max()), theta.dtype)
    level, needed = np.empty(count, np.int64), np.empty(4)
    partial[:] = 0.0
    start = 0
    for t in range(len(lay.lengths)):
        columns, last = lay.shared_sizes[t], lay.own_lengths[t] - 1
        width = width_of(columns)
        m = lay.counts[lay.terms[t, last]] if last >= 0 else 1
        outer = lay.own_sizes[t] // m
        heads[:, outer : (outer + 3) // 4 * 4] = 0.0
        n_levels = 0
        for b in range(count):
            for v in range(last):
                j = lay.terms[t, v]
                strengths_of(j, own[b, j], lay, strengths[j])
            product_of(t, 0, max(last, 0), lay, strengths, heads[b], 0)
            level[b] = -1
            for other in range(b):
                if last < 0 or own[other, lay.terms[t, last]] == own[b, lay.terms[t, last]]:
                    level[b] = level[other]
                    break
            if level[b] < 0:
                level[b] = n_levels
                levels[n_levels, 0] = 1.0
                if last >= 0:
                    j = lay.terms[t, last]
                    strengths_of(j, own[b, j], lay, strengths[j])
                    levels[n_levels, :m] = strengths[j, :m]
                n_levels += 1
        blended = np.zeros((n_levels, 4 * width), theta.dtype)
        for p in range(0, outer, 4):
            for i in range(4):
                needed[i] = 0.0
                for b in range(count):
                    needed[i] = max(needed[i], heads[b, p + i])
                if needed[i] > least:
                    at = lay.offsets[t] + (p + i) * m * columns
                    # A row may be read on into the next one, where there is one.
                    n = width if at + (m - 1) * columns + width <= len(theta) else columns
                    for v in range(n_levels):
                        _blend(
                            theta[at:], columns, levels[v, :m],
                            blended[v, i * width : i * width + n],
                        )  # fmt: skip
            if needed.max() > least:
                for b in range(count):
                    four = heads[b, p : p + 4]
                    if max(max(four[0], four[1]), max(four[2], four[3])) > least:
                        _add_four(partial[b, start : start + width], blended[level[b]], four)
        start += width


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
