"""What a robot does once it has chosen a pushing point: it drives there, and pushes straight on."""

from collections.abc import Mapping
from math import cos, sin
from typing import Any

import numpy as np

from ....core.numerics.arrays import FloatArray, IntArray
from ..scenario import BoxPushing
from ..world.geometry import wrap
from .driving import Drivers
from .points import pushing_points

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
