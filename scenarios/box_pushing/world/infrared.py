"""Infrared sensors of round robots.

A sensor looks along one ray from the rim of its robot and reads a number in [0, 1]: 1 when
touching, 0 when nothing is within its reach, and in between according to `InfraredSettings`.
"""

from math import exp
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, njit
from ...angles import rotate
from .geometry import BoxShape, ray

Response = tuple[float, float]
"""Distance beyond which readings are 0, and distance over which they fall to 1/e [m]."""


class InfraredSensors(NamedTuple):
    """Infrared sensors of M round robots, S on each."""

    radii: FloatArray
    """``(M,)`` radii of the robots [m]."""
    directions: FloatArray
    """``(M, S)`` directions of the sensors in the body frame [rad]."""
    response: Response
    """Readings by distance."""


@njit(cache=True)
def _reading(distance: float, response: Response) -> float:
    reach, decay = response
    return exp(-max(distance, 0.0) / decay) if distance < reach else 0.0


@njit(cache=True)
def readings_at(distances: FloatArray, response: Response) -> FloatArray:
    """Return the readings at distances ``(m,)`` straight ahead [m]; negative distances touch."""
    out = np.empty(len(distances))
    for i in range(len(distances)):
        out[i] = _reading(distances[i], response)
    return out


@njit(cache=True)
def infrared_readings(
    robots: FloatArray,
    box: FloatArray,
    gaps: FloatArray,
    shape: BoxShape,
    sensors: InfraredSensors,
) -> FloatArray:
    """Return the readings of the box ``(M, S)`` by the sensors of all robots.

    Other robots are not seen, and do not hide the box.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` poses.
    gaps
        ``(M,)`` gaps between robots and box [m].
    shape
        Outline of the box.
    sensors
        The sensors.
    """
    radii, directions, response = sensors
    out = np.zeros(directions.shape)
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(len(robots)):
        if gaps[r] >= response[0]:
            continue
        x, y = rotate(cos, -sin, robots[r, 0] - box[0], robots[r, 1] - box[1])
        for k in range(directions.shape[1]):
            angle = robots[r, 2] + directions[r, k] - box[2]
            dx, dy = np.cos(angle), np.sin(angle)
            start_x, start_y = x + radii[r] * dx, y + radii[r] * dy
            out[r, k] = _reading(ray(shape, start_x, start_y, dx, dy, response[0]), response)
    return out
