"""Pushing points, and what a robot does once it has chosen one: drive there, push straight on.

Where a robot may stand to push a box is computed from the outline of the box. This is how box
pushing is made easy by those who assign one agent to a robot (Wang and de Silva 2006): where to
push is given, and what remains to be learned is which point to push at. The points are numbered by
where they are on the outline. What is learned of a point is learned of its number, and means
something else where the outline is another.
"""

from collections.abc import Mapping
from math import atan2, cos, sin
from typing import Any

import numpy as np
from shapely.geometry import Point, Polygon
from shapely.geometry.polygon import orient

from ....core.numerics.arrays import FloatArray, IntArray
from ..scenario import BoxPushing
from ..world.boxes import BoxSpec
from ..world.geometry import surface, wrap
from .driving import Drivers

ARC = 64
"""Corners of a quarter of a circle."""
WAITING_GAP = 0.015
"""Gap to the box at which a robot arrives at its point [m]."""
AHEAD, BEHIND, ASIDE, TURN = 0.04, 0.05, 0.045, 0.7
"""How far a robot may be off its point and still pushes [m, m, m, rad]."""
STRAIGHT = 0.1
"""How much a radian off the direction of pushing counts [m]."""


class Pushing:
    """Drives robots to pushing points of a box, and straight on from there.

    Parameters
    ----------
    world
        The scenario whose wheels are driven.
    points
        How many points there are around the box.

    Attributes
    ----------
    points
        ``(points, 3)`` poses in the frame of the box.
    """

    def __init__(self, world: BoxPushing, points: int) -> None:
        self.points = pushing_points(world.box, points, world.robot.radius + WAITING_GAP)
        self._drivers = Drivers(world)

    def act(self, measurements: Mapping[str, Any], chosen: IntArray) -> IntArray:
        """Return the actions of all wheels ``(n,)`` of robots on their way to points ``(M,)``.

        `measurements` are what `BoxPushing.measure` returns.
        """
        robots, box = measurements["robot_poses"], measurements["box_pose"]
        speeds = measurements["wheel_speeds"]
        actions = []
        for robot, (pose, point) in enumerate(zip(robots, self.points[chosen], strict=True)):
            target = _in_world(box, point)
            if _is_at(pose, target):
                local = self._straight_on(robot, pose, speeds, target[2])
            else:
                local = self._drivers.drive(robot, robots, box, speeds, target)
            actions.append(self._drivers.choices[local])
        return np.concatenate(actions)

    def _straight_on(self, robot: int, pose: FloatArray, speeds: FloatArray, way: float) -> int:
        """Return the robot action that pushes fastest without turning away from `way` [rad]."""
        own = speeds[self._drivers.wheels[robot]][None]
        twists = self._drivers.next(own)[1][0]
        seconds = self._drivers.seconds
        turned = np.abs(wrap(pose[2] + seconds * twists[:, 2] - way))
        return int((STRAIGHT * turned - seconds * twists[:, 0]).argmin())


def _in_world(box: FloatArray, point: FloatArray) -> FloatArray:
    """Return a pose in the frame of the box as one in the world."""
    cos_, sin_ = cos(box[2]), sin(box[2])
    x, y = cos_ * point[0] - sin_ * point[1], sin_ * point[0] + cos_ * point[1]
    return np.array([box[0] + x, box[1] + y, box[2] + point[2]])


def _is_at(pose: FloatArray, target: FloatArray) -> bool:
    """Return whether a robot is near enough to its point to push."""
    dx, dy = pose[:2] - target[:2]
    cos_, sin_ = cos(target[2]), sin(target[2])
    along, aside = cos_ * dx + sin_ * dy, cos_ * dy - sin_ * dx
    turned = abs(wrap(pose[2] - target[2]))
    return bool(-BEHIND < along < AHEAD and abs(aside) < ASIDE and turned < TURN)


def pushing_points(box: BoxSpec, count: int, gap: float) -> FloatArray:
    """Return poses ``(count, 3)`` around a box from which it can be pushed, in its frame.

    They lie at equal distances on the curve that a round body follows on its way around the box,
    counter-clockwise. The first is half such a distance past the place straight ahead of the box.

    Parameters
    ----------
    box
        The box.
    count
        How many.
    gap
        From the centre of the body to the surface of the box [m].

    Examples
    --------
    Four points around a square of 20 cm lie off its corners, eight have two to a side:

    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> pushing_points(BOXES["square"], 8, 0.05).round(2)[1:3].tolist()
    [[0.07, 0.15, -1.57], [-0.07, 0.15, -1.57]]
    """
    radius = box.outline.rounding
    solid = Point(0, 0).buffer(radius, ARC) if box.polygon is None else box.polygon
    around = orient(Polygon(Polygon(solid.exterior).buffer(gap, ARC).exterior)).exterior
    first = around.project(Point(4.0 * (box.reach + gap), 0.0))
    poses = np.empty((count, 3))
    for k in range(count):
        place = around.interpolate((first + (k + 0.5) / count * around.length) % around.length)
        _, nx, ny, _, _ = surface(box.outline.edges, radius, place.x, place.y)
        poses[k] = place.x, place.y, atan2(-ny, -nx)
    return poses
