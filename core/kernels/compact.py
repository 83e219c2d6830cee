"""Values under triangular partitions, where at most two functions per variable are active."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..arrays import FloatArray, IntArray
from .layout import Layout
from .strengths import pair


@njit(cache=True)
def _compact_value(theta, lay: Layout, lows, highs, shares) -> float:  # type: ignore[no-untyped-def]
    """Return f of one state given its two active membership functions per variable."""
    value = 0.0
    for t in range(len(lay.lengths)):
        length = lay.lengths[t]
        if length == 1:
            j = lay.terms[t, 0]
            at = lay.offsets[t]
            value += theta[at + lows[j]] + shares[j] * (theta[at + highs[j]] - theta[at + lows[j]])
            continue
        for corner in range(1 << length):
            weight, rule = 1.0, 0
            for v in range(length):
                j = lay.terms[t, v]
                upper = corner >> v & 1
                weight *= shares[j] if upper else 1.0 - shares[j]
                rule = rule * lay.counts[j] + (highs[j] if upper else lows[j])
            value += weight * theta[lay.offsets[t] + rule]
    return value


@njit(cache=True)
def values_compact(theta: FloatArray, states: FloatArray, lay: Layout) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, triangular partitions."""
    m, d = states.shape
    out = np.empty(m)
    lows, highs, shares = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    for s in range(m):
        for j in range(d):
            lows[j], highs[j], shares[j] = pair(j, states[s, j], lay)
        out[s] = _compact_value(theta, lay, lows, highs, shares)
    return out


@njit(cache=True)
def each_compact(theta: FloatArray, states: FloatArray, lay: Layout) -> FloatArray:
    """Return f ``(n, s)`` of states ``(n, s, d)``, each by its row of theta ``(n, n_rules)``."""
    out = np.empty(states.shape[:2])
    for i in range(len(states)):
        out[i] = values_compact(theta[i], states[i], lay)
    return out


@njit(cache=True)
def active_compact(states: FloatArray, lay: Layout) -> tuple[IntArray, FloatArray]:
    """Return the active rules ``(m, k)`` and their strengths ``(m, k)``, triangular partitions."""
    m, d = states.shape
    rules = np.empty((m, lay.n_active), np.int64)
    strengths = np.empty((m, lay.n_active))
    lows, highs, shares = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    for s in range(m):
        for j in range(d):
            lows[j], highs[j], shares[j] = pair(j, states[s, j], lay)
        at = 0
        for t in range(len(lay.lengths)):
            for corner in range(1 << lay.lengths[t]):
                weight, rule = 1.0, 0
                for v in range(lay.lengths[t]):
                    j = lay.terms[t, v]
                    upper = corner >> v & 1
                    weight *= shares[j] if upper else 1.0 - shares[j]
                    rule = rule * lay.counts[j] + (highs[j] if upper else lows[j])
                rules[s, at] = lay.offsets[t] + rule
                strengths[s, at] = weight
                at += 1
    return rules, strengths


@njit(cache=True)
def block_values_compact(  # type: ignore[no-untyped-def]
    theta, own, own_rows, shared, shared_rows, divisor: int, codes: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action codes from block tables, triangular partitions."""
    d = len(lay.counts)
    n_local = len(own_rows) if len(own_rows) else len(own)
    out = np.empty(len(codes))
    lows, highs, shares = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    # The own block with which a shared one was last valued, and the value.
    known = np.full(len(shared) if len(shared_rows) else 0, -1)
    memory = np.empty(len(known))
    for c in range(len(codes)):
        local = codes[c] // divisor % n_local
        mine = own_rows[local] if len(own_rows) else local
        row = shared_rows[codes[c]] if len(shared_rows) else codes[c]
        if len(known) and known[row] == mine:
            out[c] = memory[row]
            continue
        for j in range(lay.n_own):
            lows[j], highs[j], shares[j] = pair(j, own[mine, j], lay)
        for j in range(lay.n_own, d):
            lows[j], highs[j], shares[j] = pair(j, shared[row, j - lay.n_own], lay)
        out[c] = _compact_value(theta, lay, lows, highs, shares)
        if len(known):
            known[row], memory[row] = mine, out[c]
    return out
