"""Values of states where every membership function may be active, two states at a time."""

import numpy as np

from ...numerics import FloatArray, njit
from .fuzzy import Layout, Packed, unpack
from .strengths import all_strengths, hull, negligible, product_of, strengths_room


@njit(cache=True, fastmath={"reassoc", "contract"})
def _sums(
    rows: FloatArray,
    one: FloatArray,
    two: FloatArray,
    first: FloatArray,
    second: FloatArray,
    tops: FloatArray,
    parts: FloatArray,
    least: float,
) -> tuple[float, float]:
    """Return ``heads @ rows @ tail`` for two pairs of heads and tails ``(one, first), ...``.

    `tops` ``(2, outer)`` bound m heads each, `parts` ``(2, q)`` every q-th part of the tails.
    """
    outer, m, columns = rows.shape
    width = columns // parts.shape[1]
    bounds = np.empty(parts.shape[1])
    f = g = 0.0
    for p in range(outer):
        at = p * m
        for i in range(len(bounds)):
            bounds[i] = max(tops[0, p] * parts[0, i], tops[1, p] * parts[1, i])
        begin, end = hull(bounds, 0, len(bounds), least)
        # The plain loop makes an update take 1.0 to 1.1 times as long (paired, 5^7 rules, n = 4).
        if m == 5:
            a = one[at]
            b = one[at + 1]
            c = one[at + 2]
            d = one[at + 3]
            e = one[at + 4]
            u = two[at]
            v = two[at + 1]
            w = two[at + 2]
            x = two[at + 3]
            y = two[at + 4]
            for k in range(np.uint64(begin * width), np.uint64(end * width)):
                q = rows[p, 0, k]
                r = rows[p, 1, k]
                s = rows[p, 2, k]
                t = rows[p, 3, k]
                z = rows[p, 4, k]
                f += ((a * q + b * r) + (c * s + d * t) + e * z) * first[k]
                g += ((u * q + v * r) + (w * s + x * t) + y * z) * second[k]
            continue
        for s in range(m):
            for k in range(columns):
                f += one[at + s] * rows[p, s, k] * first[k]
                g += two[at + s] * rows[p, s, k] * second[k]
    return f, g


@njit(cache=True)
def values_of_two(
    theta: FloatArray, one: FloatArray, two: FloatArray, lay: Layout
) -> tuple[float, float]:
    """Return f of two states given their strengths; theta is read once."""
    f = g = 0.0
    for t in range(len(lay.lengths)):
        begin = lay.offsets[t]
        end = lay.offsets[t + 1]
        rows = lay.row_sizes[t]
        split = lay.row_lengths[t]
        last = lay.lengths[t]
        m = lay.counts[lay.terms[t, split - 1]] if split else 1
        columns = (end - begin) // rows
        heads = np.empty((2, rows), theta.dtype)
        tails = np.empty((2, columns), theta.dtype)
        parts = np.empty((2, lay.part_sizes[t]))
        tops = np.empty((2, rows // m))
        for s, strengths in enumerate((one, two)):
            product_of(t, 0, split, lay, strengths, heads[s])
            product_of(t, split, last, lay, strengths, tails[s])
            product_of(t, split, lay.part_lengths[t], lay, strengths, parts[s])
            product_of(t, 0, max(0, split - 1), lay, strengths, tops[s])
        slab = theta[begin:end].reshape(rows // m, m, columns)
        more = _sums(slab, heads[0], heads[1], tails[0], tails[1], tops, parts, negligible(theta))
        f = f + more[0]
        g = g + more[1]
    return f, g


@njit(cache=True)
def each_dense(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(n, s)`` of states ``(n, s, d)``, each by its own row of theta ``(n, n_rules)``.

    Theta is read once for every two states.
    """
    lay = unpack(packed)
    n, s, _ = states.shape
    out = np.empty((n, s))
    one, room = strengths_room(lay)
    two = np.empty_like(one)
    for i in range(n):
        for k in range(0, s, 2):
            other = min(k + 1, s - 1)
            all_strengths(states[i, k], lay, one, room)
            all_strengths(states[i, other], lay, two, room)
            out[i, k], out[i, other] = values_of_two(theta[i], one, two, lay)
    return out
