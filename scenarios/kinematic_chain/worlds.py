"""The states of many arms at once, compiled, with the bits of a single one."""

import numpy as np

from ...core.numerics import FloatArray, IntArray, njit
from .variables import columns


@njit(cache=True)
def observe_worlds(
    places: FloatArray,
    angles: FloatArray,
    speeds: FloatArray,
    goals: FloatArray,
    before: FloatArray,
    rows: IntArray,
) -> FloatArray:
    """Return the states ``(W, n, len(rows))`` of all joints of all worlds, see `columns`."""
    count, n = angles.shape
    states = np.empty((count, n, len(rows)))
    for k in range(count):
        posture = places[k : k + 1]
        seen = columns(
            posture, angles[k : k + 1], speeds[k : k + 1], goals[k], before[k], 0, n, rows
        )
        states[k] = seen[:, 0]
    return states
