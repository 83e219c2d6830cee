"""Changes of consequent weights and traces along feature vectors."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..arrays import FloatArray
from .layout import Packed, unpack
from .strengths import negligible, product_of, strengths_of


@njit(cache=True, fastmath={"contract"})
def _advance(theta, trace, tail, weight, decay, step) -> None:  # type: ignore[no-untyped-def]
    """Decay one row of traces, add ``weight * tail``, and move a row of theta along it."""
    for c in range(len(tail)):
        e = decay * trace[c] + weight * tail[c]
        trace[c] = e
        theta[c] += step * e


@njit(cache=True)
def td_update(  # type: ignore[no-untyped-def]
    theta, trace, reach, states: FloatArray, steps: FloatArray, decay: float, packed: Packed
) -> None:
    """Decay the traces, add phi of the states, and move theta along them, in one pass (Eq. 12, 13).

    Rows of traces that no longer reach what is negligible are set to zero and passed over.

    Parameters
    ----------
    theta, trace
        ``(n, n_rules)`` consequent weights and eligibility traces, both modified.
    reach
        ``(n, rows of all terms)`` the most that any trace of a row of rules can be, modified.
    states
        ``(n, d)`` the previous states of the agents.
    steps
        ``(n,)`` step size times TD error of each agent.
    decay
        Discount times trace decay.
    """
    lay = unpack(packed)
    strengths = np.empty((len(lay.counts), lay.counts.max()))
    heads = np.empty(lay.row_sizes.max())
    tail = np.empty(((lay.offsets[1:] - lay.offsets[:-1]) // lay.row_sizes).max(), theta.dtype)
    kept, least = theta.dtype.type(decay), negligible(theta)
    for i in range(len(states)):
        for j in range(len(lay.counts)):
            strengths_of(j, states[i, j], lay, strengths[j])
        step = theta.dtype.type(steps[i])
        row = 0
        for t in range(len(lay.lengths)):
            product_of(t, 0, lay.row_lengths[t], lay, strengths, heads, 0)
            product_of(t, lay.row_lengths[t], lay.lengths[t], lay, strengths, tail, 0)
            columns = (lay.offsets[t + 1] - lay.offsets[t]) // lay.row_sizes[t]
            for r in range(lay.row_sizes[t]):
                at = lay.offsets[t] + r * columns
                before = reach[i, row]
                reach[i, row] = decay * before + heads[r]
                if reach[i, row] > least:
                    _advance(
                        theta[i, at : at + columns], trace[i, at : at + columns],
                        tail[:columns], theta.dtype.type(heads[r]), kept, step,
                    )  # fmt: skip
                elif before > 0.0:
                    trace[i, at : at + columns] = 0.0
                    reach[i, row] = 0.0
                row += 1


@njit(cache=True)
def add_features(  # type: ignore[no-untyped-def]
    target, states: FloatArray, weights: FloatArray, packed: Packed
) -> None:
    """Add ``weights[i] * phi(states[i])`` to row i of ``target (n, n_rules)``, in place."""
    lay = unpack(packed)
    strengths = np.empty((len(lay.counts), lay.counts.max()))
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max())
    for i in range(len(states)):
        for j in range(len(lay.counts)):
            strengths_of(j, states[i, j], lay, strengths[j])
        for t in range(len(lay.lengths)):
            product_of(t, 0, lay.own_lengths[t], lay, strengths, own, 0)
            product_of(t, lay.own_lengths[t], lay.lengths[t], lay, strengths, shared, 0)
            columns = lay.shared_sizes[t]
            for r in range(lay.own_sizes[t]):
                at = lay.offsets[t] + r * columns
                for c in range(columns):
                    target[i, at + c] += weights[i] * own[r] * shared[c]
