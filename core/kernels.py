"""Compiled kernels of the rule base: the same numbers as the NumPy definitions, fast.

Every kernel has a plain-NumPy twin: firing strengths in `nested_agents.core.fuzzy`, features in
`RuleBase.features`, temporal differences in `nested_agents.core.twins`. Nothing is compiled on
import; each kernel is compiled at its first call and cached on disk.

``Layout`` carries partitions and terms as arrays. Within a term the own variables lead, so that
its slice of theta is a matrix (own rules, shared rules).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from .arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from .fuzzy import Partition


class Layout(NamedTuple):
    """Partitions and terms of a rule base as arrays; ``t`` terms, ``d`` variables."""

    sigmoid: bool
    counts: IntArray  # (d,) membership functions
    knots: FloatArray  # (d, k) centres, on a circle with copies on either side
    n_knots: IntArray  # (d,)
    bounds: FloatArray  # (d, k - 1) midpoints between knots
    slopes: FloatArray  # (d, k - 1) sigmoid slopes
    periods: FloatArray  # (d,) 0 for linear variables
    lows: FloatArray  # (d,) lower end of the period in use
    terms: IntArray  # (t, d) variables of each term, padded with -1
    lengths: IntArray  # (t,) variables in each term
    own_lengths: IntArray  # (t,) own variables in each term
    own_sizes: IntArray  # (t,) own rules: rows of the term's matrix
    shared_sizes: IntArray  # (t,) shared rules: columns of the term's matrix
    offsets: IntArray  # (t + 1,) start of each term in theta
    shared_offsets: IntArray  # (t + 1,) start of each term among shared features
    n_active: int  # active rules under compact support
    n_own: int  # own variables


def layout(partitions: Sequence[Partition], terms: Sequence[tuple[int, ...]], n_own: int) -> Layout:
    """Pack partitions and terms for the kernels."""
    d, t = len(partitions), len(terms)
    widest = max(len(p.knots) for p in partitions)
    knots, bounds, slopes = np.zeros((d, widest)), np.zeros((d, widest)), np.zeros((d, widest))
    for j, p in enumerate(partitions):
        k = p.knots
        knots[j, : len(k)] = k
        bounds[j, : len(k) - 1] = 0.5 * (k[:-1] + k[1:])
        slopes[j, : len(k) - 1] = p.steepness / np.diff(k)
    counts = np.array([p.size for p in partitions])
    padded = np.full((t, d), -1)
    for i, term in enumerate(terms):
        padded[i, : len(term)] = term
    own = [[j for j in term if j < n_own] for term in terms]
    own_sizes = np.array([int(np.prod(counts[o])) for o in own])
    sizes = np.array([int(np.prod(counts[list(term)])) for term in terms])
    shared_sizes = sizes // own_sizes
    return Layout(
        sigmoid=partitions[0].membership == "sigmoid",
        counts=counts,
        knots=knots,
        n_knots=np.array([len(p.knots) for p in partitions]),
        bounds=bounds,
        slopes=slopes,
        periods=np.array([p.period for p in partitions]),
        lows=np.array([0.5 * (p.centres[0] + p.centres[-1] - p.period) for p in partitions]),
        terms=padded,
        lengths=np.array([len(term) for term in terms]),
        own_lengths=np.array([len(o) for o in own]),
        own_sizes=own_sizes,
        shared_sizes=shared_sizes,
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        shared_offsets=np.concatenate([[0], np.cumsum(shared_sizes)]),
        n_active=int(sum(2 ** len(term) for term in terms)),
        n_own=n_own,
    )


@njit(cache=True)
def _wrapped(j: int, x: float, lay: Layout) -> float:
    period, low = lay.periods[j], lay.lows[j]
    if period > 0.0 and not low <= x < low + period:
        x -= period * np.floor((x - low) / period)
    return x


@njit(cache=True)
def _pair(j: int, x: float, lay: Layout) -> tuple[int, int, float]:
    """Return the two neighbouring triangular functions (lower, upper) and the upper's strength."""
    x = _wrapped(j, x, lay)
    m = lay.counts[j]
    knots = lay.knots[j]
    # On a circle x lies between the last centre of the left copy and the first of the right one.
    first, last = (m - 1, 2 * m - 1) if lay.periods[j] > 0.0 else (0, m - 2)
    k = first
    while k < last and x >= knots[k + 1]:
        k += 1
    share = min(max((x - knots[k]) / (knots[k + 1] - knots[k]), 0.0), 1.0)
    lower, upper = k, k + 1
    if lower >= m:
        lower -= m
    if upper >= m:
        upper -= m
    if upper >= m:
        upper -= m
    return lower, upper, share


@njit(cache=True)
def _strengths(j: int, x: float, lay: Layout, out: FloatArray) -> None:
    """Write the firing strengths of variable j at x into ``out[:counts[j]]``."""
    m = lay.counts[j]
    for k in range(m):
        out[k] = 0.0
    if not lay.sigmoid:
        low, high, share = _pair(j, x, lay)
        out[low] += 1.0 - share
        out[high] += share
        return
    x = _wrapped(j, x, lay)
    last = lay.n_knots[j] - 1
    level = 1.0
    for k in range(last):
        exponent = -lay.slopes[j, k] * (x - lay.bounds[j, k])
        if exponent > 700.0:
            exponent = 700.0
        # Below -37 the sigmoid is one to the last bit.
        rising = 1.0 if exponent < -37.0 else 1.0 / (1.0 + np.exp(exponent))
        if rising > level:
            rising = level
        out[k % m] += level - rising
        level = rising
    out[last % m] += level


@njit(cache=True)
def _product(term: int, first: int, last: int, lay: Layout, strengths, out, start: int) -> None:  # type: ignore[no-untyped-def]
    """Write the products of the strengths of variables first..last-1 of a term, in C order."""
    out[start] = 1.0
    size = 1
    for v in range(first, last):
        j = lay.terms[term, v]
        m = lay.counts[j]
        for r in range(size - 1, -1, -1):
            base = out[start + r]
            for k in range(m):
                out[start + r * m + k] = base * strengths[j, k]
        size *= m


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
            lows[j], highs[j], shares[j] = _pair(j, states[s, j], lay)
        out[s] = _compact_value(theta, lay, lows, highs, shares)
    return out


@njit(cache=True)
def values_dense(theta: FloatArray, states: FloatArray, lay: Layout) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, all membership functions active."""
    m, d = states.shape
    out = np.empty(m)
    strengths = np.empty((d, lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max())
    for s in range(m):
        for j in range(d):
            _strengths(j, states[s, j], lay, strengths[j])
        value = 0.0
        for t in range(len(lay.lengths)):
            _product(t, 0, lay.own_lengths[t], lay, strengths, own, 0)
            _product(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared, 0)
            columns = lay.shared_sizes[t]
            for r in range(lay.own_sizes[t]):
                at = lay.offsets[t] + r * columns
                inner = 0.0
                for c in range(columns):
                    inner += theta[at + c] * shared[c]
                value += own[r] * inner
        out[s] = value
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
            lows[j], highs[j], shares[j] = _pair(j, states[s, j], lay)
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
    theta, own, shared, divisor: int, codes: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action codes from block tables, triangular partitions."""
    d = len(lay.counts)
    out = np.empty(len(codes))
    lows, highs, shares = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    for c in range(len(codes)):
        code = codes[c]
        local = code // divisor % len(own)
        for j in range(lay.n_own):
            lows[j], highs[j], shares[j] = _pair(j, own[local, j], lay)
        for j in range(lay.n_own, d):
            lows[j], highs[j], shares[j] = _pair(j, shared[code, j - lay.n_own], lay)
        out[c] = _compact_value(theta, lay, lows, highs, shares)
    return out


@njit(cache=True, fastmath={"reassoc", "contract"})
def block_values_dense(  # type: ignore[no-untyped-def]
    theta, own, shared, divisor: int, codes: IntArray, lay: Layout
) -> FloatArray:
    """Return f of joint-action codes from block tables, all membership functions active.

    Contracts theta with the own features of each local code that occurs, once, to the weights of
    the shared features; a joint action then costs one inner product with its shared features.
    """
    d = len(lay.counts)
    n_shared = lay.shared_offsets[-1]
    partial = np.zeros((len(own), n_shared))
    seen = np.zeros(len(own), np.bool_)
    strengths = np.empty((d, lay.counts.max()))
    features = np.empty(max(lay.own_sizes.max(), n_shared))
    out = np.empty(len(codes))
    for c in range(len(codes)):
        code = codes[c]
        local = code // divisor % len(own)
        if not seen[local]:
            seen[local] = True
            for j in range(lay.n_own):
                _strengths(j, own[local, j], lay, strengths[j])
            for t in range(len(lay.lengths)):
                _product(t, 0, lay.own_lengths[t], lay, strengths, features, 0)
                columns = lay.shared_sizes[t]
                row = partial[local, lay.shared_offsets[t] : lay.shared_offsets[t + 1]]
                for r in range(lay.own_sizes[t]):
                    weight = features[r]
                    at = lay.offsets[t] + r * columns
                    for k in range(columns):
                        row[k] += weight * theta[at + k]
        for j in range(lay.n_own, d):
            _strengths(j, shared[code, j - lay.n_own], lay, strengths[j])
        for t in range(len(lay.lengths)):
            _product(
                t, lay.own_lengths[t], lay.lengths[t], lay, strengths, features,
                lay.shared_offsets[t],
            )  # fmt: skip
        value = 0.0
        for k in range(n_shared):
            value += partial[local, k] * features[k]
        out[c] = value
    return out


@njit(cache=True)
def td_update(  # type: ignore[no-untyped-def]
    theta, trace, states: FloatArray, steps: FloatArray, decay: float, lay: Layout
) -> None:
    """Decay the traces, add phi of the states, and move theta along them, in one pass (Eq. 12, 13).

    Parameters
    ----------
    theta, trace
        ``(n, n_rules)`` consequent weights and eligibility traces, both modified.
    states
        ``(n, d)`` the previous states of the agents.
    steps
        ``(n,)`` step size times TD error of each agent.
    decay
        Discount times trace decay.
    """
    d = len(lay.counts)
    strengths = np.empty((d, lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max())
    for i in range(len(states)):
        for j in range(d):
            _strengths(j, states[i, j], lay, strengths[j])
        for t in range(len(lay.lengths)):
            _product(t, 0, lay.own_lengths[t], lay, strengths, own, 0)
            _product(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared, 0)
            columns = lay.shared_sizes[t]
            for r in range(lay.own_sizes[t]):
                at = lay.offsets[t] + r * columns
                for c in range(columns):
                    e = decay * trace[i, at + c] + own[r] * shared[c]
                    trace[i, at + c] = e
                    theta[i, at + c] += steps[i] * e


@njit(cache=True)
def add_features(  # type: ignore[no-untyped-def]
    target, states: FloatArray, weights: FloatArray, lay: Layout
) -> None:
    """Add ``weights[i] * phi(states[i])`` to row i of ``target (n, n_rules)``, in place."""
    d = len(lay.counts)
    strengths = np.empty((d, lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max())
    for i in range(len(states)):
        for j in range(d):
            _strengths(j, states[i, j], lay, strengths[j])
        for t in range(len(lay.lengths)):
            _product(t, 0, lay.own_lengths[t], lay, strengths, own, 0)
            _product(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared, 0)
            columns = lay.shared_sizes[t]
            for r in range(lay.own_sizes[t]):
                at = lay.offsets[t] + r * columns
                for c in range(columns):
                    target[i, at + c] += weights[i] * own[r] * shared[c]
