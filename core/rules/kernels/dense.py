"""Values where every membership function may be active.

The own axes of a term are contracted in `contraction`, then its shared axes here, for many
situations side by side. An agent's own actions are valued over the joint actions of the agents
below in one call: by one kernel for every way of valuing, so that none is compiled that is not
used.
"""

from typing import TypeAlias

import numpy as np

from ...numerics import BoolArray, FloatArray, IntArray, njit
from .compact_states import looked_up
from .contraction import contract
from .fuzzy import BlockTables, Layout, Packed, unpack
from .strengths import LANES, many_strengths

_FAST = {"reassoc", "contract"}


@njit(cache=True, fastmath=_FAST)
def _fold_weights(
    weights: FloatArray,
    start: int,
    size: int,
    m: int,
    strengths: FloatArray,
    out: FloatArray,
    lanes: int,
) -> None:
    """Contract the last axis of weights that are the same in all lanes."""
    for i in range(size // m):
        at = start + i * m
        # The plain loop makes a decision take .99 to 1.07 times as long (paired, 5^7, n = 4).
        if m == 5:
            a = weights[at]
            b = weights[at + 1]
            c = weights[at + 2]
            d = weights[at + 3]
            e = weights[at + 4]
            for k in range(np.uint64(lanes)):
                out[i, k] = (
                    (a * strengths[0, k] + b * strengths[1, k])
                    + (c * strengths[2, k] + d * strengths[3, k])
                    + e * strengths[4, k]
                )
            continue
        for k in range(np.uint64(lanes)):
            out[i, k] = weights[at] * strengths[0, k]
        for s in range(1, m):
            for k in range(np.uint64(lanes)):
                out[i, k] += weights[at + s] * strengths[s, k]


@njit(cache=True, fastmath=_FAST)
def _fold_rows(
    rows: FloatArray, size: int, m: int, strengths: FloatArray, out: FloatArray, lanes: int
) -> None:
    """Contract the last axis of `size` rows of lanes."""
    for i in range(size // m):
        at = i * m
        for k in range(np.uint64(lanes)):
            out[i, k] = rows[at, k] * strengths[0, k]
        for s in range(1, m):
            for k in range(np.uint64(lanes)):
                out[i, k] += rows[at + s, k] * strengths[s, k]


@njit(cache=True)
def fold(
    partial: FloatArray,
    strengths: FloatArray,
    lay: Layout,
    one: FloatArray,
    two: FloatArray,
    out: FloatArray,
    wanted: int,
) -> None:
    """Contract what `contract` left for one own block with shared blocks side by side.

    Parameters
    ----------
    partial
        ``(shared rules,)`` weights.
    strengths
        ``(d - n_own, most memberships, lanes)`` of the shared variables.
    lay
        Layout of the rule base.
    one, two
        Scratch, ``(largest shared size, lanes)``.
    out
        ``(lanes,)`` the values.
    wanted
        How many of them are wanted.
    """
    lanes = (wanted + 7) // 8 * 8  # whole vectors
    out[:] = 0.0
    start = 0
    for t in range(len(lay.lengths)):
        size = lay.shared_sizes[t]
        first = lay.own_lengths[t]
        v = lay.lengths[t] - 1
        if first > v:
            out += partial[start]
        else:
            j = lay.terms[t, v]
            _fold_weights(partial, start, size, lay.counts[j], strengths[j - lay.n_own], one, lanes)
            left = size // lay.counts[j]
            while v > first:
                v -= 1
                j = lay.terms[t, v]
                _fold_rows(one, left, lay.counts[j], strengths[j - lay.n_own], two, lanes)
                one, two = two, one
                left //= lay.counts[j]
            out += one[0]
        start += size


CHUNK = 64
"""States whose own blocks are compared with each other."""


@njit(cache=True)
def values_dense(theta: FloatArray, states: FloatArray, packed: Packed) -> FloatArray:
    """Return f ``(m,)`` of states ``(m, d)``, all membership functions active."""
    lay = unpack(packed)
    out = np.empty(len(states))
    none = np.empty(0, np.int64)
    for begin in range(0, len(states), CHUNK):
        chunk = states[begin : begin + CHUNK]
        own = chunk[:, : lay.n_own].copy()
        shared = chunk[:, lay.n_own :].copy()
        every = np.empty(len(chunk), np.int64)
        first = np.empty(len(chunk), np.int64)
        for s in range(len(chunk)):  # states of one own block share its contraction
            every[s] = s
            first[s] = 0
            while first[s] < s and (own[first[s]] != own[s]).any():
                first[s] += 1
        values = folded(theta, (own, first, shared, none, 1), every, lay)
        for s in range(len(chunk)):
            out[begin + s] = values[s]
    return out


@njit(cache=True)
def pairs(tables: BlockTables, indices: IntArray) -> tuple[IntArray, IntArray, IntArray, BoolArray]:
    """Sort joint-action indices by the blocks that they lead to.

    Parameters
    ----------
    tables
        Own blocks and their rows, shared blocks and theirs, and the divisor, as in `Blocks`.
    indices
        ``(m,)`` joint-action indices.

    Returns
    -------
    used
        ``(b,)`` rows of `own` that occur.
    slot_of, row_of
        ``(m,)`` index into `used`, and row of `shared`, of every index.
    wanted
        ``(b, R)`` which pairs occur.
    """
    own, own_rows, shared, shared_rows, divisor = tables
    n_local = len(own_rows) if len(own_rows) else len(own)
    slots = np.full(len(own), -1)
    used = np.empty(len(own), np.int64)
    slot_of = np.empty(len(indices), np.int32)
    row_of = np.empty(len(indices), np.int32)
    count = 0
    for c in range(len(indices)):
        local = indices[c] // divisor % n_local
        at = own_rows[local] if len(own_rows) else local
        if slots[at] < 0:
            slots[at] = count
            used[count] = at
            count += 1
        slot_of[c] = slots[at]
        row_of[c] = shared_rows[indices[c]] if len(shared_rows) else indices[c]
    wanted = np.zeros((count, len(shared)), np.bool_)
    for c in range(len(indices)):
        wanted[slot_of[c], row_of[c]] = True
    return used[:count], slot_of, row_of, wanted


@njit(cache=True)
def folded(theta: FloatArray, tables: BlockTables, indices: IntArray, lay: Layout) -> FloatArray:
    """Return f of joint-action indices from block tables, all membership functions active.

    Contracts theta with each own block that occurs, once; each distinct pair of own and shared
    block is then folded, once, whatever the number of indices that lead to it.
    """
    own, _, shared, _, _ = tables
    used, slot_of, row_of, wanted = pairs(tables, indices)
    count, n_rows = wanted.shape
    met = np.empty(n_rows, np.int64)  # rows of shared blocks that occur
    n_met = 0
    for row in range(n_rows):
        if wanted[:, row].any():
            met[n_met] = row
            n_met += 1
    n_shared = shared.shape[1]
    most = lay.counts.max()
    at = shared[met[:n_met]]
    strengths = np.zeros((n_shared, most, n_met))
    peaks = np.zeros((len(lay.counts), most))
    for j in range(n_shared):
        many_strengths(lay.n_own + j, at[:, j], lay, strengths[j])
        for s in range(most):
            peaks[lay.n_own + j, s] = strengths[j, s].max()
    partial = np.empty((count, lay.shared_sizes.sum()), theta.dtype)
    contract(theta, own[used], peaks, lay, partial)
    room = np.zeros((n_shared, most, LANES), theta.dtype)
    one = np.empty((lay.shared_sizes.max(), LANES), theta.dtype)
    two = np.empty_like(one)
    sums = np.empty(LANES, theta.dtype)
    rows = np.empty(LANES, np.int64)
    values = np.empty((count, n_rows))
    for b in range(count):
        lane = 0
        for k in range(n_met):
            if wanted[b, met[k]]:
                rows[lane] = met[k]
                for j in range(n_shared):
                    for s in range(most):
                        room[j, s, lane] = strengths[j, s, k]
                lane += 1
            if lane and (lane == LANES or k == n_met - 1):
                fold(partial[b], room, lay, one, two, sums, lane)
                for i in range(lane):
                    values[b, rows[i]] = sums[i]
                lane = 0
    out = np.empty(len(indices))
    for c in range(len(indices)):
        out[c] = values[slot_of[c], row_of[c]]
    return out


Tried: TypeAlias = tuple[IntArray, IntArray, IntArray]
"""The joint actions that an agent tries, given ones above, all below, as a plain tuple.

- ``(A, m)`` indices of own action and joint action of the agents below, the first of which varies
  most slowly; the others take action 0;
- ``(n,)`` what an action of each of these others adds to an index, 0 for the rest;
- ``(k,)`` the agents below.
"""


@njit(cache=True)
def _indices(tried: Tried, joint_action: IntArray) -> IntArray:
    indices_of, places, _ = tried
    given = 0
    rows, m = indices_of.shape
    for i in range(len(joint_action)):
        given += places[i] * joint_action[i]
    indices = np.empty(rows * m, np.int64)
    for a in range(rows):
        for c in range(m):
            indices[a * m + c] = indices_of[a, c] + given
    return indices


@njit(cache=True)
def _aggregate(values: FloatArray, tried: Tried, probabilities: FloatArray) -> FloatArray:
    """Return per own action the mean by probability ``(n, A)``, or the maximum if none is given."""
    n_own, m = tried[0].shape
    below = tried[2]
    out = np.empty(n_own)
    if not len(probabilities):
        for a in range(n_own):
            out[a] = values[a * m]
            for c in range(a * m + 1, (a + 1) * m):
                out[a] = max(out[a], values[c])
        return out
    joint = np.empty(m)
    size = 1
    joint[0] = 1.0
    for agent in below:
        n_actions = probabilities.shape[1]
        for c in range(size - 1, -1, -1):
            one = joint[c]
            for a in range(n_actions):
                joint[c * n_actions + a] = one * probabilities[agent, a]
        size *= n_actions
    total = 0.0
    for c in range(m):
        total += joint[c]
    for a in range(n_own):
        mean = 0.0
        for c in range(m):
            mean += joint[c] * values[a * m + c]
        out[a] = mean / total
    return out


@njit(cache=True)
def _learned(theta: FloatArray) -> bool:
    """Return whether any weight is not zero."""
    for weight in theta:  # noqa: SIM110
        if weight != 0.0:
            return True
    return False


@njit(cache=True)
def enumerate_looked_up(
    theta: FloatArray,
    tables: BlockTables,
    tried: Tried,
    joint_action: IntArray,
    probabilities: FloatArray,
    packed: Packed,
) -> FloatArray:
    """Value the own actions ``(A,)`` by looking up every active rule, triangular partitions.

    Parameters
    ----------
    theta
        ``(n_rules,)`` the agent's consequent weights.
    tables
        Where joint actions lead, see `core.rules.kernels.dense.pairs`.
    tried
        Which joint actions, see `Tried`.
    joint_action
        ``(n,)`` the actions that are given.
    probabilities
        ``(n, A)`` probabilities of the actions of the agents below, which are averaged over; none:
        the maximum is taken.
    packed
        Layout of the rule base.
    """
    if not _learned(theta):
        return np.zeros(len(tried[0]))
    values = looked_up(theta, tables, _indices(tried, joint_action), unpack(packed))
    return _aggregate(values, tried, probabilities)


@njit(cache=True)
def enumerate_dense(
    theta: FloatArray,
    tables: BlockTables,
    tried: Tried,
    joint_action: IntArray,
    probabilities: FloatArray,
    packed: Packed,
) -> FloatArray:
    """Do what `enumerate_looked_up` does, for sigmoid partitions."""
    if not _learned(theta):
        return np.zeros(len(tried[0]))
    values = folded(theta, tables, _indices(tried, joint_action), unpack(packed))
    return _aggregate(values, tried, probabilities)
