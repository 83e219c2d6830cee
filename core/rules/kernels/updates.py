"""Changes of consequent weights and eligibility traces along states."""

import numpy as np

from ...numerics import FloatArray, IntArray, njit
from .compact_states import active_room, value_of
from .dense_states import values_of_two
from .fuzzy import Layout, Packed, unpack
from .strengths import all_strengths, hull, negligible, product_of, strengths_room


@njit(cache=True)
def td_update(
    theta: FloatArray,
    rows: IntArray,
    trace: FloatArray,
    reach: FloatArray,
    states: FloatArray,
    entered: FloatArray,
    rewards: FloatArray,
    discount: float,
    step_size: float,
    lengths: FloatArray,
    decay: float,
    packed: Packed,
) -> None:
    """Make one TD update of every agent (Eq. 7, 12, 13), any partitions.

    Parameters
    ----------
    theta
        ``(n_rows, n_rules)`` consequent weights, modified.
    rows
        ``(n,)`` the row of theta of every agent.
    trace
        ``(n, n_rules)`` eligibility traces, modified.
    reach
        ``(n, parts of all rows)``, see `core.rules.kernels.updates.advance`, modified.
    states, entered
        ``(n, d)`` the previous states of the agents and those that followed.
    rewards, discount
        ``(n,)`` received in the previous states; weight of what follows, 0 if they were terminal.
    step_size, lengths
        Step size, and ``(n,)`` what it is divided by for every agent.
    decay
        Discount times trace decay.
    packed
        Layout of the rule base.
    """
    lay = unpack(packed)
    one, spare = strengths_room(lay)
    two = np.empty_like(one)
    functions, room, _ = active_room(lay)
    for i in range(len(states)):
        all_strengths(states[i], lay, one, spare)
        if lay.sigmoid:
            all_strengths(entered[i], lay, two, spare)
            now, ahead = values_of_two(theta[rows[i]], one, two, lay)
        else:
            now = value_of(theta[rows[i]], states[i], lay, functions, room)
            ahead = value_of(theta[rows[i]], entered[i], lay, functions, room)
        step = step_size * (rewards[i] + discount * ahead - now) / lengths[i]
        advance(theta[rows[i]], trace[i], reach[i], one, decay, step, lay)


@njit(cache=True, fastmath={"contract"})
def _reach_on(reach: FloatArray, heads: FloatArray, decay: float, least: float) -> None:
    """Decay bounds of traces and add what comes to them; those below `least` become zero."""
    for r in range(len(reach)):
        bound = decay * reach[r] + heads[r]
        reach[r] = bound if bound > least else 0.0


@njit(cache=True, fastmath={"contract"})
def _advance(
    theta: FloatArray,
    trace: FloatArray,
    heads: FloatArray,
    reach: FloatArray,
    tail: FloatArray,
    decay: np.floating,
    step: np.floating,
) -> None:
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
def advance(
    theta: FloatArray,
    trace: FloatArray,
    reach: FloatArray,
    strengths: FloatArray,
    decay: float,
    step: float,
    lay: Layout,
) -> None:
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
    own_decay = theta.dtype.type(decay)
    own_step = theta.dtype.type(step)
    done = 0
    for t in range(len(lay.lengths)):
        first = lay.offsets[t]
        last = lay.offsets[t + 1]
        rows = lay.row_sizes[t]
        columns = (last - first) // rows
        parts = rows * lay.part_sizes[t]
        heads = np.empty(rows, theta.dtype)
        tail = np.empty(columns, theta.dtype)
        product_of(t, 0, lay.row_lengths[t], lay, strengths, heads)
        product_of(t, lay.row_lengths[t], lay.lengths[t], lay, strengths, tail)
        bounds = np.empty(parts)
        product_of(t, 0, lay.part_lengths[t], lay, strengths, bounds)
        _reach_on(reach[done : done + parts], bounds, decay, negligible(theta))
        _advance(
            theta[first:last].reshape(rows, columns),
            trace[first:last].reshape(rows, columns),
            heads,
            reach[done : done + parts],
            tail,
            own_decay,
            own_step,
        )
        done += parts


@njit(cache=True)
def add_features(
    target: FloatArray, rows: IntArray, states: FloatArray, weights: FloatArray, packed: Packed
) -> None:
    """Add ``weights[i] * phi(states[i])`` to row ``rows[i]`` of ``target``, in place."""
    lay = unpack(packed)
    strengths, room = strengths_room(lay)
    own = np.empty(lay.own_sizes.max())
    shared = np.empty(lay.shared_sizes.max())
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
