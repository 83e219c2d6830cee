"""The built-in state variables of many predicted postures, compiled: `relational`, only faster."""

from math import pi

import numpy as np

from ...core.numerics.compiling import njit

COMPILED = ("bearing", "distance", "approach", "angle", "lever", "excess")
"""The built-in variables; a row of -1 is the joint's speed."""
BEARING, DISTANCE, APPROACH, ANGLE, LEVER, EXCESS = range(len(COMPILED))


@njit(cache=True)
def columns(places, angles, speeds, goal, before, first, count, rows):  # type: ignore[no-untyped-def]
    """Return the variables ``(count, m, len(rows))`` of joints from `first` on.

    Parameters are those of a `ChainView`; `rows` are indices of `COMPILED`. Columns of others stay
    zero.
    """
    m, tip = len(places), places.shape[1] - 1
    states = np.zeros((count, m, len(rows)))
    for k in range(m):
        tx, ty = places[k, tip, 0], places[k, tip, 1]
        away = np.hypot(goal[0] - tx, goal[1] - ty)
        for i in range(count):
            joint = first + i
            x, y = tx - places[k, joint, 0], ty - places[k, joint, 1]
            ahead, aside = goal[0] - places[k, joint, 0], goal[1] - places[k, joint, 1]
            for column in range(len(rows)):
                row = rows[column]
                if row == -1:
                    states[i, k, column] = speeds[k, joint]
                elif row == BEARING:
                    cross, along = x * aside - y * ahead, x * ahead + y * aside
                    states[i, k, column] = np.arctan2(cross, along)
                elif row == DISTANCE:
                    states[i, k, column] = away
                elif row == APPROACH:
                    states[i, k, column] = before - away
                elif row == ANGLE:
                    turned = angles[k, joint] + pi
                    states[i, k, column] = turned - 2.0 * pi * np.floor(turned / (2.0 * pi)) - pi
                elif row == LEVER:
                    states[i, k, column] = np.hypot(x, y)
                elif row == EXCESS:
                    states[i, k, column] = np.hypot(ahead, aside) - np.hypot(x, y)
    return states
