"""Values under triangular partitions, where at most two functions per variable are active.

The active rules of a term are the *corners* of a cube: per variable the lower or the upper of its
two active functions; bit v of a corner's number tells which it is of the term's variable v.
"""

from __future__ import annotations

import numpy as np

from ...arrays import FloatArray, IntArray
from ...compiling import njit
from .contraction import total_width
from .layout import Layout, Packed, unpack
from .pairs import pairs
from .strengths import all_strengths, pair, strengths_room
from .updates import advance


@njit(cache=True)
def _room(lay: Layout):  # type: ignore[no-untyped-def]
    """Return room for two active functions per variable, and for the corners of a term."""
    d, most = len(lay.counts), lay.n_active
    functions = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    return functions, (np.empty(most, np.int64), np.empty(most))


@njit(cache=True, inline="always")
def _pairs_of(x, first: int, lay: Layout, functions) -> None:  # type: ignore[no-untyped-def]
    """Find the active functions of variables first, first + 1, ... at the values x."""
    lows, highs, shares = functions
    for j in range(len(x)):
        lows[first + j], highs[first + j], shares[first + j] = pair(first + j, x[j], lay)


@njit(cache=True, inline="always")
def _corners(t: int, first: int, last: int, lay: Layout, functions, room) -> int:  # type: ignore[no-untyped-def]
    """Write rule and strength of every corner over variables first..last-1 of a term."""
    lows, highs, shares = functions
    rules, strengths = room
    rules[0], strengths[0], size = 0, 1.0, 1
    for v in range(first, last):
        j = lay.terms[t, v]
        m, low, high, share = lay.counts[j], lows[j], highs[j], shares[j]
        for c in range(size):
            rules[size + c], strengths[size + c] = rules[c] * m + high, strengths[c] * share
            rules[c], strengths[c] = rules[c] * m + low, strengths[c] * (1.0 - share)
        size *= 2
    return size


@njit(cache=True, inline="always")
def _compact_value(theta, lay: Layout, functions, room) -> float:  # type: ignore[no-untyped-def]
    """Return f of one state given its two active membership functions per variable."""
    lows, highs, shares = functions
    rules, strengths = room
    value = 0.0
    for t in range(len(lay.lengths)):
        at = lay.offsets[t]
        if lay.lengths[t] == 1:
            j = lay.terms[t, 0]
            value += theta[at + lows[j]] + shares[j] * (theta[at + highs[j]] - theta[at + lows[j]])
            continue
        for c in range(_corners(t, 0, lay.lengths[t], lay, functions, room)):
            value += strengths[c] * theta[at + rules[c]]
    return value


@njit(cache=True)
def _values(theta, states, lay: Layout, functions, room, out) -> None:  # type: ignore[no-untyped-def]
    for s in range(len(states)):
        _pairs_of(states[s], 0, lay, functions)
        out[s] = _compact_value(theta, lay, functions, room)


@njit(cache=True)
def values_compact(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, triangular partitions."""
    out, lay = np.empty(len(states)), unpack(packed)
    functions, room = _room(lay)
    _values(theta, states, lay, functions, room, out)
    return out


@njit(cache=True)
def each_compact(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(n, s)`` of states ``(n, s, d)``, each by its row of theta ``(n, n_rules)``."""
    out, lay = np.empty(states.shape[:2]), unpack(packed)
    functions, room = _room(lay)
    for i in range(len(states)):
        _values(theta[i], states[i], lay, functions, room, out[i])
    return out


@njit(cache=True)
def total_compact(
    theta: FloatArray, states: FloatArray, agents: IntArray, columns: IntArray, packed: Packed
) -> FloatArray:
    """Return the sum ``(s,)`` of f over some agents, see `RuleBase.total`."""
    out, lay = np.zeros(states.shape[1]), unpack(packed)
    functions, room = _room(lay)
    x = np.empty(len(columns))
    for i in range(len(agents)):
        for s in range(len(out)):
            for j in range(len(columns)):
                x[j] = states[agents[i], s, columns[j]]
            _pairs_of(x, 0, lay, functions)
            out[s] += _compact_value(theta[i], lay, functions, room)
    return out


@njit(cache=True)
def td_compact(  # type: ignore[no-untyped-def]
    theta, rows: IntArray, trace, reach, states: FloatArray, entered: FloatArray,
    rewards: FloatArray, discount: float, step_size: float, lengths: FloatArray, decay: float,
    packed: Packed,
) -> None:  # fmt: skip
    """Do what `core.rules.kernels.td_dense` does, triangular partitions."""
    lay = unpack(packed)
    strengths, spare = strengths_room(lay)
    functions, room = _room(lay)
    for i in range(len(states)):
        _pairs_of(entered[i], 0, lay, functions)
        ahead = _compact_value(theta[rows[i]], lay, functions, room)
        _pairs_of(states[i], 0, lay, functions)
        now = _compact_value(theta[rows[i]], lay, functions, room)
        all_strengths(states[i], lay, strengths, spare)
        step = step_size * (rewards[i] + discount * ahead - now) / lengths[i]
        advance(theta[rows[i]], trace[i], reach[i], strengths, decay, step, lay)


@njit(cache=True)
def active_compact(states: FloatArray, packed: Packed) -> tuple[IntArray, FloatArray]:
    """Return the active rules ``(m, k)`` and their strengths ``(m, k)``, triangular partitions."""
    lay = unpack(packed)
    rules = np.empty((len(states), lay.n_active), np.int64)
    strengths = np.empty((len(states), lay.n_active))
    functions, room = _room(lay)
    for s in range(len(states)):
        _pairs_of(states[s], 0, lay, functions)
        at = 0
        for t in range(len(lay.lengths)):
            size = _corners(t, 0, lay.lengths[t], lay, functions, room)
            for c in range(size):
                rules[s, at + c] = lay.offsets[t] + room[0][c]
                strengths[s, at + c] = room[1][c]
            at += size
    return rules, strengths


@njit(cache=True)
def looked_up(  # type: ignore[no-untyped-def]
    theta, own, own_rows, shared, shared_rows, divisor: int, indices: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action indices from block tables: every active rule is looked up."""
    n_local = len(own_rows) if len(own_rows) else len(own)
    out = np.empty(len(indices))
    functions, room = _room(lay)
    # The own block with which a shared one was last valued, and the value.
    known = np.full(len(shared) if len(shared_rows) else 0, -1)
    memory, last = np.empty(len(known)), -1
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        mine = own_rows[local] if len(own_rows) else local
        row = shared_rows[indices[c]] if len(shared_rows) else indices[c]
        if len(known) and known[row] == mine:
            out[c] = memory[row]
            continue
        if mine != last:
            _pairs_of(own[mine], 0, lay, functions)
            last = mine
        _pairs_of(shared[row], lay.n_own, lay, functions)
        out[c] = _compact_value(theta, lay, functions, room)
        if len(known):
            known[row], memory[row] = mine, out[c]
    return out


@njit(cache=True, fastmath={"contract"})
def _add(target, row, weight) -> None:  # type: ignore[no-untyped-def]
    for k in range(len(target)):
        target[k] += weight * row[k]


@njit(cache=True)
def contracted(  # type: ignore[no-untyped-def]
    theta, own, own_rows, shared, shared_rows, divisor: int, indices: IntArray, lay: Layout
) -> FloatArray:
    """Return what `looked_up` does: the active own rules are summed up once per own block."""
    functions, room = _room(lay)
    rules, strengths = room
    used, slot_of, row_of, wanted = pairs(own, own_rows, shared, shared_rows, divisor, indices)
    partial = np.zeros((len(used), total_width(lay)), theta.dtype)
    for b in range(len(used)):
        _pairs_of(own[used[b]], 0, lay, functions)
        start = 0
        for t in range(len(lay.lengths)):
            columns = lay.shared_sizes[t]
            for c in range(_corners(t, 0, lay.own_lengths[t], lay, functions, room)):
                at = lay.offsets[t] + rules[c] * columns
                weight = theta.dtype.type(strengths[c])
                _add(partial[b, start : start + columns], theta[at : at + columns], weight)
            start += columns
    values = np.empty(wanted.shape)
    for row in range(wanted.shape[1]):
        if not wanted[:, row].any():
            continue
        _pairs_of(shared[row], lay.n_own, lay, functions)
        values[:, row] = 0.0
        start = 0
        for t in range(len(lay.lengths)):
            size = _corners(t, lay.own_lengths[t], lay.lengths[t], lay, functions, room)
            for b in range(len(used)):
                if wanted[b, row]:
                    for c in range(size):
                        values[b, row] += strengths[c] * partial[b, start + rules[c]]
            start += lay.shared_sizes[t]
    out = np.empty(len(indices))
    for c in range(len(indices)):
        out[c] = values[slot_of[c], row_of[c]]
    return out
