"""Shared blocks of many predicted situations, compiled: those of `state_spaces`, only faster.

Situations stand side by side in flat scratch rows, as in `push_lanes`, and all loops over them are
free of branches. The NumPy functions of the state spaces are the definition and the test oracle;
they also serve sensing, where there is one situation only.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numba import njit

from ..core.arrays import FloatArray

LANES = 32
"""Situations side by side."""
_EXACT = {"contract", "nsz"}

# Scratch rows.
COURSE, DISTANCE, PUSH, TURN, OTHERS, BEARING, OFF = 0, 1, 2, 3, 4, 5, 6
_ROWS = 8


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def angle_of(x, y):  # type: ignore[no-untyped-def]
    """Return the angle of a vector, as ``arctan2(y, x)`` to its last bits.

    The angle with the nearer axis or diagonal is below pi / 8; there the rational function of
    Moshier's Cephes library holds.
    """
    ax, ay = abs(x), abs(y)
    low, high = min(ax, ay), max(ax, ay)
    diagonal = low > 0.41421356237309503 * high
    top = low - high if diagonal else low
    bottom = low + high if diagonal else high
    t = top / (bottom if bottom > 0.0 else 1.0)
    z = t * t
    p = -8.750608600031904122785e-1
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    angle = t + t * (z * p / q)
    angle = 0.25 * pi + angle if diagonal else angle
    angle = 0.5 * pi - angle if ay > ax else angle
    angle = pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def wrapped(angle):  # type: ignore[no-untyped-def]
    """Map an angle to [-pi, pi)."""
    return angle - 2.0 * pi * np.floor((angle + pi) / (2.0 * pi))


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def _to_goal(box, goal, first, count, work):  # type: ignore[no-untyped-def]
    gx, gy = goal[0], goal[1]
    bx, by = box[0, first : first + count], box[1, first : first + count]
    for k in range(count):
        dx, dy = gx - bx[k], gy - by[k]
        work[COURSE * LANES + k] = angle_of(dx, dy)
        work[DISTANCE * LANES + k] = np.sqrt(dx * dx + dy * dy)


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def _push(robots, box, goal, first, count, work):  # type: ignore[no-untyped-def]
    """Write where the robots' middle would push the box relative to the course, and its turn."""
    n, turned = len(robots), goal[2]
    for k in range(count):
        work[BEARING * LANES + k] = work[OFF * LANES + k] = 0.0
    for r in range(n):
        x, y = robots[r, 0, first : first + count], robots[r, 1, first : first + count]
        for k in range(count):
            work[BEARING * LANES + k] += x[k]
            work[OFF * LANES + k] += y[k]
    bx, by, psi = (
        box[0, first : first + count], box[1, first : first + count], box[2, first : first + count],
    )  # fmt: skip
    for k in range(count):
        dx, dy = bx[k] - work[BEARING * LANES + k] / n, by[k] - work[OFF * LANES + k] / n
        work[PUSH * LANES + k] = wrapped(angle_of(dx, dy) - work[COURSE * LANES + k])
        work[TURN * LANES + k] = wrapped(psi[k] - turned)


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def _stand(robot, box, first, count, work):  # type: ignore[no-untyped-def]
    """Write the bearing of the box from a robot, and where round the box it stands."""
    x, y = robot[0, first : first + count], robot[1, first : first + count]
    bx, by = box[0, first : first + count], box[1, first : first + count]
    psi = robot[2, first : first + count]
    for k in range(count):
        azimuth = angle_of(bx[k] - x[k], by[k] - y[k])
        work[BEARING * LANES + k] = wrapped(azimuth - psi[k])
        work[OFF * LANES + k] = wrapped(azimuth - work[COURSE * LANES + k])


@njit(cache=True, error_model="numpy", fastmath=_EXACT)
def _others(gaps, robot, first, count, work):  # type: ignore[no-untyped-def]
    """Write the greatest gap of the other robots; of the robot itself if it is alone."""
    n = len(gaps)
    for k in range(count):
        work[OTHERS * LANES + k] = -np.inf
    for r in range(n):
        if r != robot or n == 1:
            gap = gaps[r, first : first + count]
            for k in range(count):
                work[OTHERS * LANES + k] = max(work[OTHERS * LANES + k], gap[k])


@njit(cache=True)
def relational(
    robots: FloatArray, box: FloatArray, gaps: FloatArray, goal: FloatArray, wanted: FloatArray
) -> FloatArray:
    """Return the relational shared blocks ``(robots wanted, m, 7)``.

    Parameters
    ----------
    robots, box, gaps
        ``(M, 3, m)``, ``(3, m)`` and ``(M, m)``: a `View`, its situations last.
    goal
        ``(3,)`` pose.
    wanted
        Indices of robots.
    """
    m = box.shape[1]
    out, work = np.empty((len(wanted), m, 7)), np.empty(_ROWS * LANES)
    for first in range(0, m, LANES):
        count = min(LANES, m - first)
        _to_goal(box, goal, first, count, work)
        _push(robots, box, goal, first, count, work)
        for i in range(len(wanted)):
            r = wanted[i]
            _stand(robots[r], box, first, count, work)
            _others(gaps, r, first, count, work)
            for k in range(count):
                row = out[i, first + k]
                row[0] = gaps[r, first + k]
                row[1], row[2] = work[BEARING * LANES + k], work[OFF * LANES + k]
                row[3], row[4] = work[OTHERS * LANES + k], work[PUSH * LANES + k]
                row[5], row[6] = work[TURN * LANES + k], work[DISTANCE * LANES + k]
    return out
