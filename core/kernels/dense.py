"""Values where every membership function may be active."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..arrays import FloatArray, IntArray
from .layout import Layout
from .strengths import NEGLIGIBLE, product_of, strengths_of


@njit(cache=True, fastmath={"reassoc", "contract"})
def _inner(one, other) -> float:  # type: ignore[no-untyped-def]
    """Return the inner product of two arrays of one length, in their precision."""
    total = one.dtype.type(0.0)
    for k in range(len(one)):
        total += one[k] * other[k]
    return float(total)


@njit(cache=True)
def values_dense(theta: FloatArray, states: FloatArray, lay: Layout) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, all membership functions active."""
    out = np.empty(len(states))
    strengths = np.empty((len(lay.counts), lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max(), theta.dtype)
    for s in range(len(states)):
        out[s] = _value(theta, states[s], lay, strengths, own, shared)
    return out


@njit(cache=True)
def each_dense(theta: FloatArray, states: FloatArray, lay: Layout) -> FloatArray:
    """Return f ``(n,)`` of states ``(n, d)``, each by its own row of theta ``(n, n_rules)``."""
    out = np.empty(len(states))
    strengths = np.empty((len(lay.counts), lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max(), theta.dtype)
    for i in range(len(states)):
        out[i] = _value(theta[i], states[i], lay, strengths, own, shared)
    return out


@njit(cache=True)
def _value(theta, state, lay: Layout, strengths, own, shared) -> float:  # type: ignore[no-untyped-def]
    """Return f of one state; the last three arguments are scratch."""
    for j in range(len(lay.counts)):
        strengths_of(j, state[j], lay, strengths[j])
    value = 0.0
    for t in range(len(lay.lengths)):
        product_of(t, 0, lay.own_lengths[t], lay, strengths, own, 0)
        product_of(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared, 0)
        columns = lay.shared_sizes[t]
        for r in range(lay.own_sizes[t]):
            if own[r] > NEGLIGIBLE:
                at = lay.offsets[t] + r * columns
                value += own[r] * _inner(theta[at : at + columns], shared[:columns])
    return value


@njit(cache=True, fastmath={"reassoc", "contract"})
def _add_four(part, rows, weights):  # type: ignore[no-untyped-def]
    """Add four weighted rows of theta to `part`."""
    n = len(part)
    one, two, three, four = rows[:n], rows[n : 2 * n], rows[2 * n : 3 * n], rows[3 * n :]
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    for k in range(n):
        part[k] += (a * one[k] + b * two[k]) + (c * three[k] + d * four[k])


@njit(cache=True, fastmath={"reassoc", "contract"})
def _contract(theta, own, lay: Layout, partial) -> None:  # type: ignore[no-untyped-def]
    """Contract theta with the own features of every own block ``(K, n_own)``.

    Writes the weights ``(K, all shared features)`` that remain for the shared features. Rows of
    theta are taken four at a time, so that each is read once however many own blocks there are.
    """
    strengths = np.empty((len(lay.counts), lay.counts.max()))
    widest = lay.own_sizes.max()
    features = np.empty((len(own), (widest + 3) // 4 * 4), theta.dtype)
    partial[:] = 0.0
    for t in range(len(lay.lengths)):
        rows, columns = lay.own_sizes[t], lay.shared_sizes[t]
        first, last = lay.shared_offsets[t], lay.shared_offsets[t + 1]
        for b in range(len(own)):
            for v in range(lay.own_lengths[t]):
                j = lay.terms[t, v]
                strengths_of(j, own[b, j], lay, strengths[j])
            product_of(t, 0, lay.own_lengths[t], lay, strengths, features[b], 0)
        whole = rows // 4 * 4
        for r in range(0, whole, 4):
            at = lay.offsets[t] + r * columns
            for b in range(len(own)):
                four = features[b, r : r + 4]
                if max(max(four[0], four[1]), max(four[2], four[3])) > NEGLIGIBLE:
                    _add_four(partial[b, first:last], theta[at : at + 4 * columns], four)
        for r in range(whole, rows):
            at = lay.offsets[t] + r * columns
            for b in range(len(own)):
                weight = features[b, r]
                if weight > NEGLIGIBLE:
                    for k in range(columns):
                        partial[b, first + k] += weight * theta[at + k]


@njit(cache=True)
def block_values_dense(  # type: ignore[no-untyped-def]
    theta, own, own_rows, shared, shared_rows, divisor: int, codes: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action codes from block tables, all membership functions active.

    Contracts theta with the own features of each own block that occurs, once, to the weights of
    the shared features; each distinct pair of own and shared block then costs one inner product.
    """
    d = len(lay.counts)
    n_shared = lay.shared_offsets[-1]
    n_local = len(own_rows) if len(own_rows) else len(own)
    slots = np.full(len(own), -1)
    used = np.empty_like(own)
    count = 0
    for c in range(len(codes)):
        local = codes[c] // divisor % n_local
        at = own_rows[local] if len(own_rows) else local
        if slots[at] < 0:
            slots[at] = count
            used[count] = own[at]
            count += 1
    partial = np.empty((count, n_shared), theta.dtype)
    _contract(theta, used[:count], lay, partial)
    strengths = np.empty((d, lay.counts.max()))
    features = np.empty(n_shared, theta.dtype)
    # The own block with which a shared one was last valued, and the value.
    known = np.full(len(shared) if len(shared_rows) else 0, -1)
    memory = np.empty(len(known))
    out = np.empty(len(codes))
    for c in range(len(codes)):
        local = codes[c] // divisor % n_local
        slot = slots[own_rows[local] if len(own_rows) else local]
        row = shared_rows[codes[c]] if len(shared_rows) else codes[c]
        if len(known) and known[row] == slot:
            out[c] = memory[row]
            continue
        for j in range(lay.n_own, d):
            strengths_of(j, shared[row, j - lay.n_own], lay, strengths[j])
        for t in range(len(lay.lengths)):
            product_of(
                t, lay.own_lengths[t], lay.lengths[t], lay, strengths, features,
                lay.shared_offsets[t],
            )  # fmt: skip
        out[c] = _inner(partial[slot], features)
        if len(known):
            known[row], memory[row] = slot, out[c]
    return out
