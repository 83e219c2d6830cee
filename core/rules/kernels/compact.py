"""Values under triangular partitions, where at most two functions per variable are active.

The active rules of a term are the *corners* of a cube: per variable the lower or the upper of its
two active functions; bit v of a corner's number tells which it is of the term's variable v.
"""

import numpy as np

from ...numerics import FloatArray, IntArray, njit
from .layout import Layout, Packed, unpack
from .strengths import all_strengths, pair, strengths_room
from .updates import advance, values_of_two


@njit(cache=True)
def _room(lay: Layout):  # type: ignore[no-untyped-def]
    """Return room for two active functions per variable, for the corners of a term, and a mark."""
    d, most = len(lay.counts), lay.n_active
    functions = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    return functions, (np.empty(most, np.int64), np.empty(most)), np.empty(d, np.bool_)


@njit(cache=True, inline="always")
def _corners(variables, counts, lows, highs, shares, rules, strengths) -> int:  # type: ignore[no-untyped-def]
    """Write rule and strength of every corner of a term over these variables."""
    rules[0], strengths[0], size = 0, 1.0, 1
    for v in range(len(variables)):
        j = variables[v]
        m, low, high, share = counts[j], lows[j], highs[j], shares[j]
        for c in range(size):
            rules[size + c], strengths[size + c] = rules[c] * m + high, strengths[c] * share
            rules[c], strengths[c] = rules[c] * m + low, strengths[c] * (1.0 - share)
        size *= 2
    return size


@njit(cache=True, inline="always")
def _value(theta, state, lay: Layout, functions, room) -> float:  # type: ignore[no-untyped-def]
    """Return f of one state.

    By `_add_values` in its place a TD update takes 1.1 times as long with rules over all variables
    of two robots, and 1.3 times with rules over single ones of eight (paired).
    """
    lows, highs, shares = functions
    rules, strengths = room
    for j in range(len(state)):
        lows[j], highs[j], shares[j] = pair(j, state[j], lay)
    value = 0.0
    for t in range(len(lay.lengths)):
        at = lay.offsets[t]
        if lay.lengths[t] == 1:
            j = lay.terms[t, 0]
            value += theta[at + lows[j]] + shares[j] * (theta[at + highs[j]] - theta[at + lows[j]])
            continue
        variables = lay.terms[t, : lay.lengths[t]]
        for c in range(_corners(variables, lay.counts, lows, highs, shares, rules, strengths)):
            value += strengths[c] * theta[at + rules[c]]
    return value


@njit(cache=True)
def _add_values(  # type: ignore[no-untyped-def]
    theta, which: IntArray, own, own_rows: IntArray, shared, shared_rows: IntArray, skipped: int,
    lay: Layout, room, total,
) -> None:  # fmt: skip
    """Add to a total ``(m,)`` what some terms are worth in m states.

    Arrays are taken out of tuples before the loops: to do so within costs more than the arithmetic,
    and so does room that is made anew for every agent.

    Parameters
    ----------
    theta
        ``(n_rules,)`` consequent weights.
    which
        Indices of terms.
    own, own_rows
        Rows of own variables, and which of them belongs to each state ``(m,)``.
    shared, shared_rows, skipped
        Rows of variables from the one numbered `skipped` on, likewise.
    lay, room
        Layout, triangular partitions, and what `_room` makes for it.
    total
        ``(m,)``, changed.
    """
    if len(which) == 0:
        return
    (lows, highs, shares), (rules, strengths), needed = room
    counts, terms, lengths, offsets = lay.counts, lay.terms, lay.lengths, lay.offsets
    for j in range(len(needed)):
        needed[j] = False
    for t in which:
        for v in range(lengths[t]):
            needed[terms[t, v]] = True
    for s in range(len(total)):
        mine, theirs = own_rows[s], shared_rows[s]
        for j in range(len(needed)):
            if needed[j]:
                x = own[mine, j] if j < lay.n_own else shared[theirs, j - skipped]
                lows[j], highs[j], shares[j] = pair(j, x, lay)
        value = 0.0
        for t in which:
            at, j = offsets[t], terms[t, 0]
            if lengths[t] == 1:
                low, high = theta[at + lows[j]], theta[at + highs[j]]
                value += low + shares[j] * (high - low)
                continue
            variables = terms[t, : lengths[t]]
            size = _corners(variables, counts, lows, highs, shares, rules, strengths)
            for c in range(size):
                value += strengths[c] * theta[at + rules[c]]
        total[s] += value


@njit(cache=True)
def _numbered(n: int) -> IntArray:
    """Return 0, 1, ..., n - 1: `np.arange` takes half a second to compile."""
    numbers = np.empty(n, np.int64)
    for i in range(n):
        numbers[i] = i
    return numbers


@njit(cache=True)
def each_compact(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(n, s)`` of states ``(n, s, d)``, each by its row of theta ``(n, n_rules)``."""
    out, lay = np.zeros(states.shape[:2]), unpack(packed)
    room = _room(lay)
    terms, rows = _numbered(len(lay.lengths)), _numbered(states.shape[1])
    for i in range(len(states)):
        _add_values(theta[i], terms, states[i], rows, states[i], rows, 0, lay, room, out[i])
    return out


@njit(cache=True, fastmath={"contract", "nsz"})
def _add_lines(theta, which: IntArray, states, rows: IntArray, skipped: int, lay: Layout, total):  # type: ignore[no-untyped-def]
    """Add to a total ``(m,)`` what terms of single variables are worth to k agents in m states.

    Such a value is that at the first centre, and a bend at every centre: loops over the states have
    no branch. By `_add_values` in its place a team of 64 robots is valued in three times the time.

    Parameters
    ----------
    theta, which
        ``(k, n_rules)`` consequent weights, and indices of terms; products among them are skipped.
    states, rows, skipped
        ``(b, m, d)`` variables from the one numbered `skipped` on, and which b is each agent's.
    lay
        Layout, triangular partitions.
    total
        ``(m,)``, changed.
    """
    knots, m, xs = lay.knots, len(total), np.empty(len(total))
    for t in which:
        if lay.lengths[t] > 1:
            continue
        j, at = lay.terms[t, 0], lay.offsets[t]
        size, period, low = lay.counts[j], lay.periods[j], lay.lows[j]
        # On a circle the first centre is the last of the turn before, the last the first after it.
        first, last = (-1, size) if period > 0.0 else (0, size - 1)
        copies = size if period > 0.0 else 0
        for i in range(len(theta)):
            row, value, slope = rows[i], theta[i, at + copies + first], 0.0
            for s in range(m):
                x = states[row, s, j - skipped]
                xs[s] = x - period * np.floor((x - low) / period) if period > 0.0 else x
                total[s] += value
            for k in range(first, last + 1):
                centre, bend = knots[j, copies + k], -slope
                if k < last:
                    after = theta[i, at + (k + 1 if k + 1 < size else k + 1 - size)]
                    bend += (after - value) / (knots[j, copies + k + 1] - centre)
                    value = after
                slope += bend
                for s in range(m):
                    over = xs[s] - centre
                    total[s] += bend * (over if over > 0.0 else 0.0)


@njit(cache=True)
def total_compact(  # type: ignore[no-untyped-def]
    weights, agents: IntArray, firsts: IntArray, kinds, own: FloatArray, shared: FloatArray,
    packed: Packed,
) -> FloatArray:  # fmt: skip
    """Return the summed value ``(m,)`` of agents, each thing that they share valued once.

    Parameters
    ----------
    weights
        Consequent weights of the k agents ``(k, n_rules)``, of their b bodies ``(b, n_rules)``
        and of all ``(1, n_rules)``: those that see the same are summed.
    agents, firsts
        ``(k,)`` and ``(b + 1,)``: the agents, and the first of each body among them.
    kinds
        The terms of own variables, of variables of the body, and of those common to all.
    own, shared
        Own variables ``(n, m, n_own)`` of all agents, shared ones ``(b, m, d - n_own)`` of the
        bodies.
    packed
        Layout, triangular partitions.
    """
    of_agents, of_bodies, of_all = weights
    of_own, of_body, of_common = kinds
    lay, m = unpack(packed), own.shape[1]
    rows, n_own, room = _numbered(m), lay.n_own, _room(lay)
    mine, theirs, total = np.zeros(m), np.zeros(m), np.zeros(m)
    bodies = _numbered(len(shared))
    _add_lines(of_agents, of_own, own, agents, 0, lay, mine)
    _add_lines(of_bodies, of_body, shared, bodies, n_own, lay, theirs)
    _add_lines(of_all, of_common, shared, bodies, n_own, lay, total)
    of_own = of_own[lay.lengths[of_own] > 1]
    of_body = of_body[lay.lengths[of_body] > 1]
    of_common = of_common[lay.lengths[of_common] > 1]
    # A call takes a microsecond, as long as the lines of an agent.
    for b in range(len(shared) if len(of_own) + len(of_body) > 0 else 0):
        for i in range(firsts[b], firsts[b + 1]):
            a = agents[i]
            _add_values(of_agents[i], of_own, own[a], rows, shared[b], rows, n_own, lay, room, mine)
        _add_values(of_bodies[b], of_body, own[0], rows, shared[b], rows, n_own, lay, room, theirs)
    _add_values(of_all[0], of_common, own[0], rows, shared[0], rows, n_own, lay, room, total)
    for s in range(m):
        total[s] = mine[s] + theirs[s] + total[s]
    return total


@njit(cache=True)
def td_update(  # type: ignore[no-untyped-def]
    theta, rows: IntArray, trace, reach, states: FloatArray, entered: FloatArray,
    rewards: FloatArray, discount: float, step_size: float, lengths: FloatArray, decay: float,
    packed: Packed,
) -> None:  # fmt: skip
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
    functions, room, _ = _room(lay)
    for i in range(len(states)):
        all_strengths(states[i], lay, one, spare)
        if lay.sigmoid:
            all_strengths(entered[i], lay, two, spare)
            now, ahead = values_of_two(theta[rows[i]], one, two, lay)
        else:
            now = _value(theta[rows[i]], states[i], lay, functions, room)
            ahead = _value(theta[rows[i]], entered[i], lay, functions, room)
        step = step_size * (rewards[i] + discount * ahead - now) / lengths[i]
        advance(theta[rows[i]], trace[i], reach[i], one, decay, step, lay)


@njit(cache=True)
def active_compact(states: FloatArray, packed: Packed) -> tuple[IntArray, FloatArray]:
    """Return the active rules ``(m, k)`` and their strengths ``(m, k)``, triangular partitions."""
    lay = unpack(packed)
    rules = np.empty((len(states), lay.n_active), np.int32)  # of all experience they are kept
    strengths = np.empty((len(states), lay.n_active))
    (lows, highs, shares), (numbers, products), _ = _room(lay)
    for s in range(len(states)):
        for j in range(states.shape[1]):
            lows[j], highs[j], shares[j] = pair(j, states[s, j], lay)
        at = 0
        for t in range(len(lay.lengths)):
            variables = lay.terms[t, : lay.lengths[t]]
            size = _corners(variables, lay.counts, lows, highs, shares, numbers, products)
            for c in range(size):
                rules[s, at + c] = lay.offsets[t] + numbers[c]
                strengths[s, at + c] = products[c]
            at += size
    return rules, strengths


@njit(cache=True)
def looked_up(theta, tables, indices: IntArray, lay: Layout) -> FloatArray:  # type: ignore[no-untyped-def]
    """Return f of joint-action indices from block tables: every active rule is looked up."""
    own, own_rows, shared, shared_rows, divisor = tables
    n_local = len(own_rows) if len(own_rows) else len(own)
    # The own block with which a shared one was last met, and the number of that pair.
    n_known = len(shared) if len(shared_rows) else 0
    known, number = np.empty(n_known, np.int64), np.empty(n_known, np.int64)
    for row in range(n_known):
        known[row] = -1
    mine, theirs = np.empty(len(indices), np.int64), np.empty(len(indices), np.int64)
    pair_of, n_pairs = np.empty(len(indices), np.int64), 0
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        a = own_rows[local] if len(own_rows) else local
        row = shared_rows[indices[c]] if len(shared_rows) else indices[c]
        if len(known) and known[row] == a:
            pair_of[c] = number[row]
            continue
        mine[n_pairs], theirs[n_pairs], pair_of[c] = a, row, n_pairs
        if len(known):
            known[row], number[row] = a, n_pairs
        n_pairs += 1
    values, n_own = np.zeros(n_pairs), lay.n_own
    terms = _numbered(len(lay.lengths))
    _add_values(theta, terms, own, mine, shared, theirs, n_own, lay, _room(lay), values)
    out = np.empty(len(indices))
    for c in range(len(indices)):
        out[c] = values[pair_of[c]]
    return out
