"""States one by one: their values, and changes of consequent weights and traces along them.

Under triangular partitions at most two functions per variable are active. The active rules of a
term are the *corners* of a cube: per variable the lower or the upper of its two active functions;
bit v of a corner's number tells which it is of the term's variable v.
"""

import numpy as np

from ...numerics import FloatArray, IntArray, njit
from .contraction import all_strengths, hull, negligible, pair, product_of, strengths_room
from .fuzzy import Layout, Packed, unpack


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
        ``(n, parts of all rows)``, see `core.rules.kernels.states.advance`, modified.
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
    # The own block, from 1, with which a shared one was last met, and the number of that pair.
    n_known = len(shared) if len(shared_rows) else 0
    known, number = np.zeros(n_known, np.int64), np.empty(n_known, np.int64)
    mine, theirs = np.empty(len(indices), np.int64), np.empty(len(indices), np.int64)
    pair_of, n_pairs = np.empty(len(indices), np.int64), 0
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        a = own_rows[local] if len(own_rows) else local
        row = shared_rows[indices[c]] if len(shared_rows) else indices[c]
        if len(known) and known[row] == a + 1:
            pair_of[c] = number[row]
            continue
        mine[n_pairs], theirs[n_pairs], pair_of[c] = a, row, n_pairs
        if len(known):
            known[row], number[row] = a + 1, n_pairs
        n_pairs += 1
    values, n_own = np.zeros(n_pairs), lay.n_own
    terms = _numbered(len(lay.lengths))
    _add_values(theta, terms, own, mine, shared, theirs, n_own, lay, _room(lay), values)
    out = np.empty(len(indices))
    for c in range(len(indices)):
        out[c] = values[pair_of[c]]
    return out


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
        # The plain loop makes an update take 1.0 to 1.1 times as long (paired, 5^7 rules, n = 4).
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
def values_of_two(theta, one, two, lay: Layout) -> tuple[float, float]:  # type: ignore[no-untyped-def]
    """Return f of two states given their strengths; theta is read once."""
    f = g = 0.0
    for t in range(len(lay.lengths)):
        begin, end, rows = lay.offsets[t], lay.offsets[t + 1], lay.row_sizes[t]
        split, last = lay.row_lengths[t], lay.lengths[t]
        m = lay.counts[lay.terms[t, split - 1]] if split else 1
        columns = (end - begin) // rows
        heads, tails = np.empty((2, rows), theta.dtype), np.empty((2, columns), theta.dtype)
        parts, tops = np.empty((2, lay.part_sizes[t])), np.empty((2, rows // m))
        for s, strengths in enumerate((one, two)):
            product_of(t, 0, split, lay, strengths, heads[s])
            product_of(t, split, last, lay, strengths, tails[s])
            product_of(t, split, lay.part_lengths[t], lay, strengths, parts[s])
            product_of(t, 0, max(0, split - 1), lay, strengths, tops[s])
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
            out[i, k], out[i, other] = values_of_two(theta[i], one, two, lay)
    return out
