"""Values of an agent's own actions over the joint actions of the agents below, in one call.

There is one kernel for every way of valuing, so that none is compiled that is not used.
"""

from typing import TypeAlias

import numpy as np

from ...numerics import IntArray, njit
from .compact import looked_up
from .dense import folded
from .layout import Packed, unpack

Tried: TypeAlias = tuple[IntArray, IntArray, IntArray]
"""The joint actions that an agent tries, given ones above, all below, as a plain tuple.

- ``(A, m)`` indices of own action and joint action of the agents below, the first of which varies
  most slowly; the others take action 0;
- ``(n,)`` what an action of each of these others adds to an index, 0 for the rest;
- ``(k,)`` the agents below.
"""


@njit(cache=True)
def _indices(tried, joint_action):  # type: ignore[no-untyped-def]
    indices_of, places, _ = tried
    given, (rows, m) = 0, indices_of.shape
    for i in range(len(joint_action)):
        given += places[i] * joint_action[i]
    indices = np.empty(rows * m, np.int64)
    for a in range(rows):
        for c in range(m):
            indices[a * m + c] = indices_of[a, c] + given
    return indices


@njit(cache=True)
def _aggregate(values, tried, probabilities):  # type: ignore[no-untyped-def]
    """Return per own action the mean by probability ``(n, A)``, or the maximum if none is given."""
    (n_own, m), below = tried[0].shape, tried[2]
    out = np.empty(n_own)
    if not len(probabilities):
        for a in range(n_own):
            out[a] = values[a * m]
            for c in range(a * m + 1, (a + 1) * m):
                out[a] = max(out[a], values[c])
        return out
    joint, size = np.empty(m), 1
    for c in range(m):
        joint[c] = 1.0
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
def _learned(theta) -> bool:  # type: ignore[no-untyped-def]
    """Return whether any weight is not zero."""
    for weight in theta:  # noqa: SIM110
        if weight != 0.0:
            return True
    return False


@njit(cache=True)
def enumerate_looked_up(theta, tables, tried, joint_action, probabilities, packed: Packed):  # type: ignore[no-untyped-def]
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
def enumerate_dense(theta, tables, tried, joint_action, probabilities, packed: Packed):  # type: ignore[no-untyped-def]
    """Do what `enumerate_looked_up` does, for sigmoid partitions."""
    if not _learned(theta):
        return np.zeros(len(tried[0]))
    values = folded(theta, tables, _indices(tried, joint_action), unpack(packed))
    return _aggregate(values, tried, probabilities)
