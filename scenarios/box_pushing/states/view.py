"""What state variables are computed from: situations of robots, box and goal, many at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from ....core.arrays import FloatArray
from ....core.compiling import njit
from ..world.geometry import Outline, surface

CLOSE = 0.02
"""Gap [m] over which the weight of a robot's contact falls to 1/e."""
LEAST = 0.001
"""Weight of a robot far away: where none is close, all count alike."""


@dataclass(frozen=True)
class View:
    """Situations to be described, ``m`` at once.

    Attributes
    ----------
    robots
        ``(m, M, 3)`` poses [m, m, rad].
    box
        ``(m, 3)`` poses of the box.
    gaps
        ``(m, M)`` distances between robot and box surfaces [m]; slightly negative in contact.
    goal
        ``(3,)`` goal pose of the box.
    before
        Distance of the box from the goal before the motion that led here [m].
    periods
        How many decision periods that motion took.
    outline
        Of the box, in its own frame.
    """

    robots: FloatArray
    box: FloatArray
    gaps: FloatArray
    goal: FloatArray
    before: float
    periods: float
    outline: Outline

    # What all robots share is computed once, and must stay as it is.

    def guarded(self) -> View:
        """Return the same situations, not to be written to."""
        robots, box, gaps = (_fixed(a.view()) for a in (self.robots, self.box, self.gaps))
        goal = _fixed(self.goal.view())
        return View(robots, box, gaps, goal, self.before, self.periods, self.outline)

    @property
    def n_situations(self) -> int:
        """How many situations there are."""
        return len(self.box)

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the box from the goal [m]."""
        ahead = self.goal[:2] - self.box[:, :2]
        return _fixed(np.hypot(ahead[:, 0], ahead[:, 1]))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the box comes to the goal in a decision period [m]."""
        return (self.before - self.distance) / self.periods

    @cached_property
    def course(self) -> FloatArray:
        """Direction ``(m,)`` from the box to the goal [rad]."""
        ahead = self.goal[:2] - self.box[:, :2]
        return _fixed(np.arctan2(ahead[:, 1], ahead[:, 0]))

    @cached_property
    def push(self) -> FloatArray:
        """Direction ``(m,)`` in which the robots' middle would push the box [rad]."""
        middle = self.robots[:, :, :2].mean(axis=1)
        ahead = self.box[:, :2] - middle
        return _fixed(np.arctan2(ahead[:, 1], ahead[:, 0]))

    @cached_property
    def contact_push(self) -> FloatArray:
        """The same direction ``(m,)``, every robot weighing by how close it is to the box [rad].

        The weight of a robot is ``exp(-gap / CLOSE) + LEAST``: those that do not push do not count.
        """
        weights = (np.exp(-np.maximum(self.gaps, 0.0) / CLOSE) + LEAST)[:, :, None]
        middle = (weights * self.robots[:, :, :2]).sum(axis=1) / weights.sum(axis=1)
        ahead = self.box[:, :2] - middle
        return _fixed(np.arctan2(ahead[:, 1], ahead[:, 0]))

    @cached_property
    def turn(self) -> FloatArray:
        """Turn ``(m,)`` of the box from the goal pose [rad]."""
        return _fixed(wrap(self.box[:, 2] - self.goal[2]))

    def azimuth(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` from a robot to the box [rad]."""
        pose = self.robots[:, robot]
        return np.arctan2(self.box[:, 1] - pose[:, 1], self.box[:, 0] - pose[:, 0])

    def inward(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` into the box at the point of its surface next to a robot [rad]."""
        return _inward(self.robots[:, robot], self.box, self.outline.edges, self.outline.rounding)


def _fixed(array: FloatArray) -> FloatArray:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


@njit(cache=True)
def _inward(robots, boxes, edges, rounding):  # type: ignore[no-untyped-def]
    """Return the direction into the box ``(m,)`` at the point next to each robot, world frame."""
    directions = np.empty(len(robots))
    for c in range(len(robots)):
        cos, sin = np.cos(boxes[c, 2]), np.sin(boxes[c, 2])
        dx, dy = robots[c, 0] - boxes[c, 0], robots[c, 1] - boxes[c, 1]
        near = surface(edges, rounding, cos * dx + sin * dy, cos * dy - sin * dx)
        directions[c] = boxes[c, 2] + np.arctan2(-near[2], -near[1])
    return directions


_TURN = 2.0 * pi
_TURN_HIGH = 6.283185243606567
"""The leading 26 bits of a turn: products with a few thousand turns are exact."""
_TURN_LOW = _TURN - _TURN_HIGH


def wrap(angle: FloatArray) -> FloatArray:
    """Map angles to [-pi, pi): ``(angle + pi) % (2 pi) - pi`` to the last bit, but faster."""
    shifted = angle + pi
    turns = np.floor(shifted / _TURN)
    return shifted - turns * _TURN_HIGH - turns * _TURN_LOW - pi
