"""Values of states under triangular partitions, by the few rules that are active.

At most two functions per variable are active. The active rules of a term are the *corners* of a
cube: per variable the lower or the upper of its two active functions; bit v of a corner's number
tells which it is of the term's variable v.
"""

from typing import TypeAlias

import numpy as np

from ...numerics import BoolArray, FloatArray, IntArray, njit
from .fuzzy import BlockTables, Layout, Packed, unpack
from .strengths import pair

Functions: TypeAlias = tuple[IntArray, IntArray, FloatArray]
"""Per variable the lower and the upper of its two active functions, and the upper's strength."""
Corners: TypeAlias = tuple[IntArray, FloatArray]
"""Rules and strengths of the corners of a term."""
ActiveRoom: TypeAlias = tuple[Functions, Corners, BoolArray]
"""Room for both, and a mark per variable."""


@njit(cache=True)
def active_room(lay: Layout) -> ActiveRoom:
    """Return room for two active functions per variable, for the corners of a term, and a mark."""
    d = len(lay.counts)
    most = lay.n_active
    functions = np.empty(d, np.int64), np.empty(d, np.int64), np.empty(d)
    return functions, (np.empty(most, np.int64), np.empty(most)), np.empty(d, np.bool_)


@njit(cache=True, inline="always")
def _corners(
    variables: IntArray,
    counts: IntArray,
    lows: IntArray,
    highs: IntArray,
    shares: FloatArray,
    rules: IntArray,
    strengths: FloatArray,
) -> int:
    """Write rule and strength of every corner of a term over these variables."""
    rules[0] = 0
    strengths[0] = 1.0
    size = 1
    for v in range(len(variables)):
        j = variables[v]
        m = counts[j]
        low = lows[j]
        high = highs[j]
        share = shares[j]
        for c in range(size):
            rules[size + c] = rules[c] * m + high
            strengths[size + c] = strengths[c] * share
            rules[c] = rules[c] * m + low
            strengths[c] = strengths[c] * (1.0 - share)
        size *= 2
    return size


@njit(cache=True, inline="always")
def value_of(
    theta: FloatArray, state: FloatArray, lay: Layout, functions: Functions, room: Corners
) -> float:
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
def _add_values(
    theta: FloatArray,
    which: IntArray,
    own: FloatArray,
    own_rows: IntArray,
    shared: FloatArray,
    shared_rows: IntArray,
    skipped: int,
    lay: Layout,
    room: ActiveRoom,
    total: FloatArray,
) -> None:
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
        Layout, triangular partitions, and what `active_room` makes for it.
    total
        ``(m,)``, changed.
    """
    if len(which) == 0:
        return
    (lows, highs, shares), (rules, strengths), needed = room
    counts = lay.counts
    terms = lay.terms
    lengths = lay.lengths
    offsets = lay.offsets
    for j in range(len(needed)):
        needed[j] = False
    for t in which:
        for v in range(lengths[t]):
            needed[terms[t, v]] = True
    for s in range(len(total)):
        mine = own_rows[s]
        theirs = shared_rows[s]
        for j in range(len(needed)):
            if needed[j]:
                x = own[mine, j] if j < lay.n_own else shared[theirs, j - skipped]
                lows[j], highs[j], shares[j] = pair(j, x, lay)
        value = 0.0
        for t in which:
            at = offsets[t]
            j = terms[t, 0]
            if lengths[t] == 1:
                low = theta[at + lows[j]]
                high = theta[at + highs[j]]
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
    out = np.zeros(states.shape[:2])
    lay = unpack(packed)
    room = active_room(lay)
    terms = _numbered(len(lay.lengths))
    rows = _numbered(states.shape[1])
    for i in range(len(states)):
        _add_values(theta[i], terms, states[i], rows, states[i], rows, 0, lay, room, out[i])
    return out


@njit(cache=True, fastmath={"contract", "nsz"})
def _add_lines(
    theta: FloatArray,
    which: IntArray,
    states: FloatArray,
    rows: IntArray,
    skipped: int,
    lay: Layout,
    total: FloatArray,
) -> None:
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
    knots = lay.knots
    m = len(total)
    xs = np.empty(len(total))
    for t in which:
        if lay.lengths[t] > 1:
            continue
        j = lay.terms[t, 0]
        at = lay.offsets[t]
        size = lay.counts[j]
        period = lay.periods[j]
        low = lay.lows[j]
        # On a circle the first centre is the last of the turn before, the last the first after it.
        first, last = (-1, size) if period > 0.0 else (0, size - 1)
        copies = size if period > 0.0 else 0
        for i in range(len(theta)):
            row = rows[i]
            value = theta[i, at + copies + first]
            slope = 0.0
            for s in range(m):
                x = states[row, s, j - skipped]
                xs[s] = x - period * np.floor((x - low) / period) if period > 0.0 else x
                total[s] += value
            for k in range(first, last + 1):
                centre = knots[j, copies + k]
                bend = -slope
                if k < last:
                    after = theta[i, at + (k + 1 if k + 1 < size else k + 1 - size)]
                    bend += (after - value) / (knots[j, copies + k + 1] - centre)
                    value = after
                slope += bend
                for s in range(m):
                    over = xs[s] - centre
                    total[s] += bend * (over if over > 0.0 else 0.0)


@njit(cache=True)
def total_compact(
    weights: tuple[FloatArray, FloatArray, FloatArray],
    agents: IntArray,
    firsts: IntArray,
    kinds: tuple[IntArray, IntArray, IntArray],
    own: FloatArray,
    shared: FloatArray,
    packed: Packed,
) -> FloatArray:
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
    lay = unpack(packed)
    m = own.shape[1]
    rows = _numbered(m)
    n_own = lay.n_own
    room = active_room(lay)
    mine = np.zeros(m)
    theirs = np.zeros(m)
    total = np.zeros(m)
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
def active_compact(states: FloatArray, packed: Packed) -> tuple[IntArray, FloatArray]:
    """Return the active rules ``(m, k)`` and their strengths ``(m, k)``, triangular partitions."""
    lay = unpack(packed)
    rules = np.empty((len(states), lay.n_active), np.int32)  # of all experience they are kept
    strengths = np.empty((len(states), lay.n_active))
    (lows, highs, shares), (numbers, products), _ = active_room(lay)
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
def looked_up(theta: FloatArray, tables: BlockTables, indices: IntArray, lay: Layout) -> FloatArray:
    """Return f of joint-action indices from block tables: every active rule is looked up."""
    own, own_rows, shared, shared_rows, divisor = tables
    n_local = len(own_rows) if len(own_rows) else len(own)
    # The own block, from 1, with which a shared one was last met, and the number of that pair.
    n_known = len(shared) if len(shared_rows) else 0
    known = np.zeros(n_known, np.int64)
    number = np.empty(n_known, np.int64)
    mine = np.empty(len(indices), np.int64)
    theirs = np.empty(len(indices), np.int64)
    pair_of = np.empty(len(indices), np.int64)
    n_pairs = 0
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        a = own_rows[local] if len(own_rows) else local
        row = shared_rows[indices[c]] if len(shared_rows) else indices[c]
        if len(known) and known[row] == a + 1:
            pair_of[c] = number[row]
            continue
        mine[n_pairs] = a
        theirs[n_pairs] = row
        pair_of[c] = n_pairs
        if len(known):
            known[row] = a + 1
            number[row] = n_pairs
        n_pairs += 1
    values = np.zeros(n_pairs)
    n_own = lay.n_own
    terms = _numbered(len(lay.lengths))
    _add_values(theta, terms, own, mine, shared, theirs, n_own, lay, active_room(lay), values)
    out = np.empty(len(indices))
    for c in range(len(indices)):
        out[c] = values[pair_of[c]]
    return out
