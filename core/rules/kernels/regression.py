"""Sums over all experience that a regression needs, by the few active rules of every row."""

import numpy as np

from ...numerics.arrays import FloatArray, IntArray
from ...numerics.compiling import njit

TERMINAL, CUT_OFF = -1, -2
"""In place of the index of the next after-state: it is entered for ever; it is not known."""


@njit(cache=True)
def add_gram(
    gram: FloatArray, active: IntArray, strengths: FloatArray, weights: FloatArray
) -> None:
    """Add the weighted phi phi' of every row to `gram`."""
    for s in range(len(active)):
        for a in range(active.shape[1]):
            weighted = weights[s] * strengths[s, a]
            if weighted > 0.0:
                for b in range(active.shape[1]):
                    gram[active[s, a], active[s, b]] += weighted * strengths[s, b]


@njit(cache=True)
def row_values(theta: FloatArray, active: IntArray, strengths: FloatArray) -> FloatArray:
    """Return f ``(N,)`` of all rows."""
    values = np.zeros(len(active))
    for s in range(len(active)):
        for a in range(active.shape[1]):
            values[s] += strengths[s, a] * theta[active[s, a]]
    return values


@njit(cache=True)
def moment(
    active: IntArray, strengths: FloatArray, targets: FloatArray, n_rules: int
) -> FloatArray:
    """Return the sum of phi times target over all rows."""
    moment = np.zeros(n_rules)
    for s in range(len(active)):
        for a in range(active.shape[1]):
            moment[active[s, a]] += strengths[s, a] * targets[s]
    return moment


@njit(cache=True)
def lambda_returns(
    values: FloatArray, rewards: FloatArray, follower: IntArray, discount: float, decay: float
) -> FloatArray:
    """Return the lambda-return of every row, by recursion from the end of each episode.

    ``G(s) = R(s) + gamma ((1 - lambda) f(s') + lambda G(s'))``
    """
    returns = np.empty(len(values))
    for s in range(len(values) - 1, -1, -1):
        if follower[s] == TERMINAL:
            returns[s] = rewards[s] / (1.0 - discount)
        elif follower[s] == CUT_OFF:
            returns[s] = values[s]
        else:
            after = follower[s]
            ahead = (1.0 - decay) * values[after] + decay * returns[after]
            returns[s] = rewards[s] + discount * ahead
    return returns
