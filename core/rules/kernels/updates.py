"""Changes of consequent weights and traces along feature vectors."""

import numpy as np

from ...numerics.arrays import FloatArray, IntArray
from ...numerics.compiling import njit
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
