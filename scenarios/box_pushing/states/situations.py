"""Situations: what state variables derive from the poses of robots and box.

Kernels hold the situations of a batch side by side, on the last axis: the compiler turns loops over
them into vector instructions. That takes tuples of numbers, because arrays in a tuple are counted
references.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit
from ...angles import angle_of, rotate
from ...state_variables import freeze
from ..world.geometry import LANES, NEAREST, BoxShape, nearest_points

CONTACT_DECAY_M = 0.02
"""Gap over which the weight of a robot in `Situation.contact` falls to 1/e [m]."""
MIN_WEIGHT = 0.001
"""Weight of a robot far from the box: if none is close, all count alike."""
AWAY_M = 0.03
"""Gap from which a robot counts as away from the box [m]."""


class Robot(NamedTuple):
    """A robot, as state variables see it."""

    x: float
    """Position [m]."""
    y: float
    """Position [m]."""
    heading: float
    """Heading [rad]."""
    gap: float
    """Distance between the surfaces of robot and box [m]; slightly negative in contact."""
    inward: float
    """Direction straight into the face of the box nearest to the robot [rad]."""


class Situation(NamedTuple):
    """Robots around a box, as state variables see them.

    A compiled function receives one situation. A plain Python function receives ``m`` situations
    at once: every number, those of a `Robot` too, is then an array ``(m,)``.
    """

    box: tuple[float, float, float]
    """Pose of the box [m, m, rad]."""
    goal: tuple[float, float, float]
    """Goal pose of the box; the same in all situations."""
    origin: tuple[float, float, float]
    """Pose of the box before the motion that led here: at the previous decision in the present
    situation, at the present decision in predicted situations."""
    periods: float
    """Duration of that motion in decision periods, the same in all situations: 1 in the present
    situation, the horizon of the prediction in predicted ones. Divide motions by it."""
    friction_radius: float
    """Lever with which ground friction resists turning of the box [m]; likewise."""
    n_robots: int
    """Number of robots, likewise."""
    distance: float
    """Distance of the box from the goal [m]."""
    course: float
    """Direction from the box to the goal [rad]."""
    middle: tuple[float, float]
    """Mean position of the robots [m]."""
    n_away: float
    """Number of robots away from the box; a gap below `AWAY_M` counts in part."""
    largest_gaps: tuple[float, float]
    """Largest and second-largest gap of all robots [m]; of a single robot both its own."""
    contact: tuple[float, float]
    """Mean position of the robots [m], weighted by ``exp(-gap / CONTACT_DECAY_M) + MIN_WEIGHT``."""
    inward: float
    """Direction straight into the face of the box nearest to `contact` [rad]."""
    robots: tuple[Robot, ...]
    """All robots; empty in a compiled function."""


class SituationBatch(NamedTuple):
    """A batch of ``m`` situations of ``M`` robots, for kernels: arrays are C-contiguous."""

    robots: FloatArray
    """``(M, 3, m)`` poses of the robots [m, m, rad]."""
    boxes: FloatArray
    """``(3, m)`` poses of the box."""
    gaps: FloatArray
    """``(M, m)`` distances between the surfaces of robots and box [m]."""
    goal: FloatArray
    """``(3,)`` goal pose of the box."""
    origins: FloatArray
    """``(3, m)``, or ``(3, 1)`` if all are equal: poses of the box before the motion."""
    periods: float
    """Duration of that motion in decision periods."""
    shape: BoxShape
    """Outline of the box, and how it resists turning."""


@njit(cache=True, forceinline=True)
def away_fraction(gap: float) -> float:
    """Return to what extent a robot is away from the box, from 0 to 1."""
    return min(max(gap / AWAY_M, 0.0), 1.0)


@njit(cache=True, fastmath={"contract", "nsz"})
def summarize(batch: SituationBatch) -> FloatArray:
    """Return the fields of `Situation` from `distance` to `largest_gaps` as rows ``(7, m)``."""
    robots, boxes, gaps, goal = batch.robots, batch.boxes, batch.gaps, batch.goal
    count, _, m = robots.shape
    out = np.zeros((7, m))
    out[5:] = -np.inf
    for r in range(count):
        for s in range(m):
            gap = gaps[r, s]
            out[2, s] += robots[r, 0, s] / count
            out[3, s] += robots[r, 1, s] / count
            out[4, s] += away_fraction(gap)
            out[6, s] = max(out[6, s], min(gap, out[5, s]))
            out[5, s] = max(out[5, s], gap)
    for s in range(m):
        dx, dy = goal[0] - boxes[0, s], goal[1] - boxes[1, s]
        out[0, s], out[1, s] = np.sqrt(dx * dx + dy * dy), angle_of(dx, dy)
        out[6, s] = out[6, s] if count > 1 else out[5, s]
    return out


@njit(cache=True)
def contacts_of(batch: SituationBatch, wanted: IntArray) -> FloatArray:
    """Return `contact` and `inward` of `Situation`, then `inward` of robots ``(3 + k, m)``."""
    robots, gaps = batch.robots, batch.gaps
    count, _, m = robots.shape
    out = np.zeros((3 + len(wanted), m))
    total = np.zeros(m)
    for r in range(count):
        for s in range(m):
            weight = np.exp(-max(gaps[r, s], 0.0) / CONTACT_DECAY_M) + MIN_WEIGHT
            total[s] += weight
            out[0, s] += weight * robots[r, 0, s]
            out[1, s] += weight * robots[r, 1, s]
    for s in range(m):
        out[0, s] /= total[s]
        out[1, s] /= total[s]
    _face_directions(out[0], out[1], batch.boxes, batch.shape.edges, out[2])
    for i in range(len(wanted)):
        pose = robots[wanted[i]]
        _face_directions(pose[0], pose[1], batch.boxes, batch.shape.edges, out[3 + i])
    return out


@njit(cache=True, fastmath={"contract", "nsz"})
def _face_directions(
    x: FloatArray, y: FloatArray, boxes: FloatArray, edges: FloatArray, out: FloatArray
) -> None:
    """Write the directions ``(m,)`` into the box at the points of its surface nearest to others.

    From outside it is the direction to the nearest point, from inside away from it.
    """
    blocks = np.zeros(1, NEAREST)
    for first in range(0, len(x), LANES):
        near = blocks[0]
        used = min(LANES, len(x) - first)
        for k in range(LANES):  # unused lanes repeat the last situation
            s = first + min(k, used - 1)
            cos, sin = np.cos(boxes[2, s]), np.sin(boxes[2, s])
            near.x[k], near.y[k] = rotate(cos, -sin, x[s] - boxes[0, s], y[s] - boxes[1, s])
        nearest_points(edges, near)
        for k in range(used):
            side = 1.0 if near.distance[k] > 0.0 else -1.0
            dx, dy = side * (near.near_x[k] - near.x[k]), side * (near.near_y[k] - near.y[k])
            out[first + k] = boxes[2, first + k] + angle_of(dx, dy)


def whole_batch(batch: SituationBatch) -> Situation:
    """Return all situations of a batch as one; arrays are read-only."""
    summary = freeze(summarize(batch))
    contact = freeze(contacts_of(batch, np.arange(len(batch.robots))))
    box, origin = freeze(batch.boxes.view()), freeze(batch.origins.view())
    robots = np.concatenate([batch.robots, batch.gaps[:, None], contact[3:, None]], axis=1)
    return Situation(
        tuple(box),
        tuple(batch.goal),
        tuple(origin),
        batch.periods,
        batch.shape.friction_radius,
        len(robots),
        summary[0],
        summary[1],
        (summary[2], summary[3]),
        summary[4],
        (summary[5], summary[6]),
        (contact[0], contact[1]),
        contact[2],
        tuple(map(Robot._make, freeze(robots))),
    )
