"""Values where every membership function may be active."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..arrays import FloatArray, IntArray
from .contraction import contract, fold, hull, total_width
from .layout import Layout, Packed, unpack
from .pairs import pairs
from .strengths import (
    LANES,
    all_strengths,
    many_strengths,
    negligible,
    product_of,
    strengths_room,
)
from .updates import advance

CHUNK = 64
"""States whose own blocks are compared with each other."""


@njit(cache=True)
def _shared_strengths(shared, lay: Layout):  # type: ignore[no-untyped-def]
    """Return the strengths ``(d - n_own, most memberships, R)`` of shared blocks."""
    out = np.zeros((shared.shape[1], lay.counts.max(), len(shared)))
    for j in range(shared.shape[1]):
        many_strengths(lay.n_own + j, shared[:, j], lay, out[j])
    return out


@njit(cache=True)
def _peaks(strengths, lay: Layout):  # type: ignore[no-untyped-def]
    """Return the greatest strengths ``(d, most memberships)`` of shared variables, own ones 0."""
    out = np.zeros((len(lay.counts), strengths.shape[1]))
    for j in range(len(strengths)):
        for s in range(lay.counts[lay.n_own + j]):
            out[lay.n_own + j, s] = strengths[j, s].max()
    return out


@njit(cache=True)
def _scratch(theta, lay: Layout):  # type: ignore[no-untyped-def]
    """Return room for lanes of strengths, two folds, and values."""
    n_shared, most = len(lay.counts) - lay.n_own, lay.counts.max()
    room = np.zeros((n_shared, most, LANES), theta.dtype)
    one = np.empty((lay.shared_sizes.max(), LANES), theta.dtype)
    return room, one, np.empty_like(one), np.empty(LANES, theta.dtype)


@njit(cache=True)
def _fill(strengths, row, lane, lay: Layout, room) -> None:  # type: ignore[no-untyped-def]
    """Put the strengths of one shared block into a lane."""
    for j in range(len(room)):
        for s in range(lay.counts[lay.n_own + j]):
            room[j, s, lane] = strengths[j, s, row]


@njit(cache=True)
def values_dense(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, all membership functions active."""
    lay = unpack(packed)
    out = np.empty(len(states))
    room, one, two, found = _scratch(theta, lay)
    which = np.empty(CHUNK, np.int64)
    own = np.empty((CHUNK, lay.n_own))
    rows = np.empty(LANES, np.int64)
    partial = np.empty((min(CHUNK, len(states)), total_width(lay)), theta.dtype)
    for begin in range(0, len(states), CHUNK):
        chunk = states[begin : begin + CHUNK]
        # States of one own block share its contraction.
        count = 0
        for s in range(len(chunk)):
            which[s] = -1
            for b in range(count):
                if (own[b] == chunk[s, : lay.n_own]).all():
                    which[s] = b
                    break
            if which[s] < 0:
                which[s] = count
                own[count] = chunk[s, : lay.n_own]
                count += 1
        strengths = _shared_strengths(chunk[:, lay.n_own :], lay)
        contract(theta, own[:count], _peaks(strengths, lay), lay, partial[:count])
        for b in range(count):
            lane = 0
            for s in range(len(chunk)):
                if which[s] == b:
                    rows[lane] = s
                    _fill(strengths, s, lane, lay, room)
                    lane += 1
                if lane and (lane == LANES or s == len(chunk) - 1):
                    fold(partial[b], room, lay, one, two, found, lane)
                    for k in range(lane):
                        out[begin + rows[k]] = found[k]
                    lane = 0
    return out


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
def _values_of_two(theta, one, two, lay: Layout) -> tuple[float, float]:  # type: ignore[no-untyped-def]
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
            out[i, k], out[i, other] = _values_of_two(theta[i], one, two, lay)
    return out


@njit(cache=True)
def td_dense(  # type: ignore[no-untyped-def]
    theta, trace, reach, states: FloatArray, entered: FloatArray, reward: float, discount: float,
    step_size: float, lengths: FloatArray, decay: float, packed: Packed,
) -> None:  # fmt: skip
    """Make one TD update of every agent (Eq. 7, 12, 13), any partitions.

    Parameters
    ----------
    theta, trace
        ``(n, n_rules)`` consequent weights and eligibility traces, both modified.
    reach
        ``(n, rows of all terms)``, see `nested_agents.core.kernels.updates.advance`, modified.
    states, entered
        ``(n, d)`` the previous states of the agents and those that followed.
    reward, discount
        Received in the previous states; weight of what follows, 0 if they were terminal.
    step_size, lengths
        Step size, and ``(n,)`` what it is divided by for every agent.
    decay
        Discount times trace decay.
    packed
        Layout of the rule base.
    """
    lay = unpack(packed)
    one, room = strengths_room(lay)
    two = np.empty_like(one)
    for i in range(len(states)):
        all_strengths(states[i], lay, one, room)
        all_strengths(entered[i], lay, two, room)
        now, ahead = _values_of_two(theta[i], one, two, lay)
        step = step_size * (reward + discount * ahead - now) / lengths[i]
        advance(theta[i], trace[i], reach[i], one, decay, step, lay)


@njit(cache=True)
def folded(  # type: ignore[no-untyped-def]
    theta, own, own_rows, shared, shared_rows, divisor: int, codes: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action codes from block tables, all membership functions active.

    Contracts theta with each own block that occurs, once; each distinct pair of own and shared
    block is then folded, once, whatever the number of codes that lead to it.
    """
    used, slot_of, row_of, wanted = pairs(own, own_rows, shared, shared_rows, divisor, codes)
    count, n_rows = wanted.shape
    met = np.empty(n_rows, np.int64)  # rows of shared blocks that occur
    n_met = 0
    for row in range(n_rows):
        if wanted[:, row].any():
            met[n_met] = row
            n_met += 1
    strengths = _shared_strengths(shared[met[:n_met]], lay)
    partial = np.empty((count, total_width(lay)), theta.dtype)
    contract(theta, own[used], _peaks(strengths, lay), lay, partial)
    room, one, two, found = _scratch(theta, lay)
    rows = np.empty(LANES, np.int64)
    values = np.empty((count, n_rows))
    for b in range(count):
        lane = 0
        for k in range(n_met):
            if wanted[b, met[k]]:
                rows[lane] = met[k]
                _fill(strengths, k, lane, lay, room)
                lane += 1
            if lane and (lane == LANES or k == n_met - 1):
                fold(partial[b], room, lay, one, two, found, lane)
                for i in range(lane):
                    values[b, rows[i]] = found[i]
                lane = 0
    out = np.empty(len(codes))
    for c in range(len(codes)):
        out[c] = values[slot_of[c], row_of[c]]
    return out
