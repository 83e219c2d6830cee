"""Changes of consequent weights and traces along feature vectors.

For any partitions also values of few states of every agent.
"""

import numpy as np

from ...numerics import FloatArray, IntArray, njit
from .layout import Layout, Packed, unpack
from .strengths import all_strengths, hull, negligible, product_of, strengths_room


@njit(cache=True, fastmath={"contract"})
def _reach_on(reach, heads, decay, least) -> None:  # type: ignore[no-untyped-def]
    """Decay bounds of traces and add what comes to them; those below `least` become zero."""
    for r in range(len(reach)):
        bound = decay * reach[r] + heads[r]
        reach[r] = bound if bound > least else 0.0


@njit(cache=True, fastmath={"contract"})
def _advance(theta, trace, heads, reach, tail, decay, step) -> None:  # type: ignore[no-untyped-def]
    """Decay the traces ``(rows, columns)`` of a term, add ``heads * tail``, move theta along them.

    Of every row only what lies between parts that reach anything.
    """
    parts = len(reach) // len(heads)
    width = len(tail) // parts
    for r in range(len(heads)):
        at = r * parts
        first, last = hull(reach, at, at + parts, 0.0)
        head = heads[r]
        for c in range(np.uint64((first - at) * width), np.uint64((last - at) * width)):
            e = decay * trace[r, c] + head * tail[c]
            trace[r, c] = e
            theta[r, c] += step * e


@njit(cache=True)
def advance(theta, trace, reach, strengths, decay: float, step: float, lay: Layout) -> None:  # type: ignore[no-untyped-def]
    """Decay the traces of one agent, add phi, and move theta along them, in one pass (Eq. 12, 13).

    Parameters
    ----------
    theta, trace
        ``(n_rules,)`` consequent weights and eligibility traces, both modified.
    reach
        ``(parts of all rows,)`` the most that any trace of a part of a row of rules can be,
        modified; 0 where traces are negligible, they stay as they are.
    strengths
        ``(d, most memberships)`` firing strengths of the previous state.
    decay
        Discount times trace decay.
    step
        Step size times TD error.
    lay
        Layout of the rule base.
    """
    kept, step, done = theta.dtype.type(decay), theta.dtype.type(step), 0
    for t in range(len(lay.lengths)):
        first, last, rows = lay.offsets[t], lay.offsets[t + 1], lay.row_sizes[t]
        columns, parts = (last - first) // rows, rows * lay.part_sizes[t]
        heads, tail = np.empty(rows, theta.dtype), np.empty(columns, theta.dtype)
        product_of(t, 0, lay.row_lengths[t], lay, strengths, heads)
        product_of(t, lay.row_lengths[t], lay.lengths[t], lay, strengths, tail)
        bounds = np.empty(parts)
        product_of(t, 0, lay.part_lengths[t], lay, strengths, bounds)
        _reach_on(reach[done : done + parts], bounds, decay, negligible(theta))
        _advance(
            theta[first:last].reshape(rows, columns), trace[first:last].reshape(rows, columns),
            heads, reach[done : done + parts], tail, kept, step,
        )  # fmt: skip
        done += parts


@njit(cache=True)
def add_features(  # type: ignore[no-untyped-def]
    target, rows: IntArray, states: FloatArray, weights: FloatArray, packed: Packed
) -> None:
    """Add ``weights[i] * phi(states[i])`` to row ``rows[i]`` of ``target``, in place."""
    lay = unpack(packed)
    strengths, room = strengths_room(lay)
    own, shared = np.empty(lay.own_sizes.max()), np.empty(lay.shared_sizes.max())
    for i in range(len(states)):
        all_strengths(states[i], lay, strengths, room)
        for t in range(len(lay.lengths)):
            product_of(t, 0, lay.own_lengths[t], lay, strengths, own)
            product_of(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared)
            columns = lay.shared_sizes[t]
            for r in range(lay.own_sizes[t]):
                at = lay.offsets[t] + r * columns
                for c in range(columns):
                    target[rows[i], at + c] += weights[i] * own[r] * shared[c]


@njit(cache=True, fastmath={"reassoc", "contract"})
def _sums(rows, one, two, first, second, tops, parts, least):  # type: ignore[no-untyped-def]
    """Return ``heads @ rows @ tail`` for two pairs of heads and tails ``(one, first), ...``.

    `tops` ``(2, outer)`` bound m heads each, `parts` ``(2, q)`` every q-th part of the tails.
    """
    outer, m, columns = rows.shape
    width, bounds = columns // parts.shape[1], np.empty(parts.shape[1])
    f = g = 0.0
    for p in range(outer):
        at = p * m
        for i in range(len(bounds)):
            bounds[i] = max(tops[0, p] * parts[0, i], tops[1, p] * parts[1, i])
        begin, end = hull(bounds, 0, len(bounds), least)
        # The plain loop makes an update take 1.0 to 1.1 times as long (paired, 5^7 rules, n = 4).
        if m == 5:
            a, b, c, d, e = one[at], one[at + 1], one[at + 2], one[at + 3], one[at + 4]
            u, v, w, x, y = two[at], two[at + 1], two[at + 2], two[at + 3], two[at + 4]
            for k in range(np.uint64(begin * width), np.uint64(end * width)):
                q, r, s = rows[p, 0, k], rows[p, 1, k], rows[p, 2, k]
                t, z = rows[p, 3, k], rows[p, 4, k]
                f += ((a * q + b * r) + (c * s + d * t) + e * z) * first[k]
                g += ((u * q + v * r) + (w * s + x * t) + y * z) * second[k]
            continue
        for s in range(m):
            for k in range(columns):
                f += one[at + s] * rows[p, s, k] * first[k]
                g += two[at + s] * rows[p, s, k] * second[k]
    return f, g


@njit(cache=True)
def values_of_two(theta, one, two, lay: Layout) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Return f of two states given their strengths; theta is read once."""
    f = g = 0.0
    for t in range(len(lay.lengths)):
        begin, end, rows = lay.offsets[t], lay.offsets[t + 1], lay.row_sizes[t]
        split, last = lay.row_lengths[t], lay.lengths[t]
        m = lay.counts[lay.terms[t, split - 1]] if split else 1
        columns = (end - begin) // rows
        heads, tails = np.empty((2, rows), theta.dtype), np.empty((2, columns), theta.dtype)
        product_of(t, 0, split, lay, one, heads[0])
        product_of(t, 0, split, lay, two, heads[1])
        product_of(t, split, last, lay, one, tails[0])
        product_of(t, split, last, lay, two, tails[1])
        parts = np.empty((2, lay.part_sizes[t]))
        product_of(t, split, lay.part_lengths[t], lay, one, parts[0])
        product_of(t, split, lay.part_lengths[t], lay, two, parts[1])
        tops = np.empty((2, rows // m))
        product_of(t, 0, max(0, split - 1), lay, one, tops[0])
        product_of(t, 0, max(0, split - 1), lay, two, tops[1])
        slab = theta[begin:end].reshape(rows // m, m, columns)
        more = _sums(slab, heads[0], heads[1], tails[0], tails[1], tops, parts, negligible(theta))
        f, g = f + more[0], g + more[1]
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
