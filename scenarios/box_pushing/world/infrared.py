"""Infrared proximity sensors.

Every sensor looks along one ray from the rim of its robot and reads a number in [0, 1]: 1 when
touching, 0 when nothing is within its reach, and between them as `InfraredSettings` say.
"""

from collections.abc import Sequence
from math import exp

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.numerics.compiling import njit
from .geometry import disc_hit, ray, surface
from .robots import E_PUCK_SENSORS
from .settings import RobotSettings


@njit(cache=True)
def response(distance: float, reach: float, decay: float, kind: int) -> float:
    """Return what `InfraredSettings.reading` returns at a distance below `reach`."""
    if kind == 0:
        return exp(-distance / decay)
    return 1.0 - distance / reach if kind == 1 else 1.0


@njit(cache=True)
def infrared_readings(
    robots: FloatArray,
    radii: FloatArray,
    sensors: FloatArray,
    box: FloatArray,
    edges: FloatArray,
    rounding: float,
    reach: float,
    decay: float,
    kind: int,
) -> FloatArray:
    """Return what the sensors of all robots read.

    Parameters
    ----------
    robots, radii
        ``(M, 3)`` poses and ``(M,)`` radii of the round bodies.
    sensors
        ``(M, S)`` directions in the body frame [rad].
    box
        ``(3,)`` pose.
    edges, rounding
        Outline of the box.
    reach, decay, kind
        See `InfraredSettings`.

    Returns
    -------
    FloatArray
        ``(2, M, S)`` readings in [0, 1]: of the box alone, and of the other robots alone.
    """
    n, s = sensors.shape
    out = np.zeros((2, n, s))
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(n):
        dx, dy = robots[r, 0] - box[0], robots[r, 1] - box[1]
        bx, by = cos * dx + sin * dy, cos * dy - sin * dx
        sees_box = surface(edges, rounding, bx, by)[0] < radii[r] + reach
        for k in range(s):
            angle = robots[r, 2] + sensors[r, k]
            ux, uy = np.cos(angle), np.sin(angle)
            if sees_box:
                lx, ly = cos * ux + sin * uy, cos * uy - sin * ux
                distance = ray(
                    edges, rounding, bx + radii[r] * lx, by + radii[r] * ly, lx, ly, reach
                )
                if distance < reach:
                    out[0, r, k] = response(distance, reach, decay, kind)
            nearest = reach
            for o in range(n):
                if o == r:
                    continue
                ox, oy = robots[o, 0] - robots[r, 0], robots[o, 1] - robots[r, 1]
                span = radii[r] + radii[o] + reach
                if ox * ox + oy * oy < span * span:
                    nearest = disc_hit(
                        ox - radii[r] * ux, oy - radii[r] * uy, radii[o], ux, uy, nearest
                    )
            if nearest < reach:
                out[1, r, k] = response(nearest, reach, decay, kind)
    return out


def sensor_directions(robots: Sequence[RobotSettings]) -> FloatArray:
    """Return the directions ``(M, S)`` of the robots' sensors [rad].

    Raises
    ------
    ValueError
        If robots have different numbers of sensors.
    """
    sensors = [E_PUCK_SENSORS if robot.sensors is None else robot.sensors for robot in robots]
    counts = {len(directions) for directions in sensors}
    if len(counts) != 1:
        raise ValueError(f"robots: {sorted(counts)} sensors, must be the same number on each")
    return np.array(sensors)
