"""What state variables are computed from: situations of robots, box and goal, many at once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.numerics.compiling import njit
from ...state_variables import fixed
from ..world.geometry import Outline, surface, wrap

CLOSE = 0.02
"""Gap [m] over which the weight of a robot's contact falls to 1/e."""
LEAST = 0.001
"""Weight of a robot far away: where none is close, all count alike."""
KEPT = 0.7
"""How much of its drift a box is taken to keep; with 1 large teams steer less than they could."""
STILL = 0.005
"""Way per decision period [m] below which hardly any of it is taken for drift."""
ARRIVED = 0.1
"""Distance from the goal [m] below which a box is taken to turn no less on the way."""


@dataclass(frozen=True)
class View:
    """Situations to be described, ``m`` at once."""

    robots: FloatArray
    """``(m, M, 3)`` poses [m, m, rad]."""
    box: FloatArray
    """``(m, 3)`` poses of the box."""
    gaps: FloatArray
    """``(m, M)`` distances between robot and box surfaces [m]; slightly negative in contact."""
    goal: FloatArray
    """``(3,)`` goal pose of the box."""
    origin: FloatArray
    """``(3,)`` pose of the box before the motion that led here."""
    periods: float
    """How many decision periods that motion took."""
    outline: Outline
    """Of the box, in its own frame."""
    friction_radius: float
    """Lever with which ground friction resists turning of the box [m]."""

    @property
    def n_situations(self) -> int:
        """How many situations there are."""
        return len(self.box)

    # What all robots share is computed once, and must stay as it is.

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the box from the goal [m]."""
        ahead = self.goal[:2] - self.box[:, :2]
        return fixed(np.hypot(ahead[:, 0], ahead[:, 1]))

    @cached_property
    def before(self) -> float:
        """Distance of the box from the goal before the motion that led here [m]."""
        return float(np.hypot(self.goal[0] - self.origin[0], self.goal[1] - self.origin[1]))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the box comes to the goal in a decision period [m]."""
        return (self.before - self.distance) / self.periods

    @cached_property
    def course(self) -> FloatArray:
        """Direction ``(m,)`` from the box to the goal [rad]."""
        return _direction(self.goal[:2] - self.box[:, :2])

    @cached_property
    def push(self) -> FloatArray:
        """Direction ``(m,)`` in which the robots' middle would push the box [rad]."""
        return _direction(self.box[:, :2] - self.robots[:, :, :2].mean(axis=1))

    @cached_property
    def contact_push(self) -> FloatArray:
        """The same direction ``(m,)``, every robot weighing by how close it is to the box [rad].

        The weight of a robot is ``exp(-gap / CLOSE) + LEAST``: those that do not push do not count.
        """
        return _direction(self.box[:, :2] - self._contact)

    @cached_property
    def _contact(self) -> FloatArray:
        """The middle ``(m, 2)`` of the robots in contact [m], see `contact_push`."""
        weights = (np.exp(-np.maximum(self.gaps, 0.0) / CLOSE) + LEAST)[:, :, None]
        return (weights * self.robots[:, :, :2]).sum(axis=1) / weights.sum(axis=1)

    @cached_property
    def path(self) -> FloatArray:
        """Direction ``(m,)`` of the straight way to where the box is going [rad].

        It is the sum of three angles: the way straight into the face that is pushed; `KEPT` of the
        drift, which is the angle of the last motion off that way; and half of the turn that the
        robots in contact bring about on the way to the goal, by their lever over the square of the
        friction radius per metre, as in `prediction.push`. The last one is at most the angle at
        which they push the centre of the box, see `contact_push`.
        """
        inward = _inward(self._contact, self.box, self.outline.edges, self.outline.rounding)
        x, y = np.cos(inward), np.sin(inward)
        push = self.box[:, :2] - self._contact
        depth, lever = push[:, 0] * x + push[:, 1] * y, push[:, 1] * x - push[:, 0] * y
        way = self.box[:, :2] - self.origin[:2]
        along, across = way[:, 0] * x + way[:, 1] * y, way[:, 1] * x - way[:, 0] * y
        drift = np.arctan2(across, np.abs(along) + STILL * self.periods)
        reach = 2.0 * self.friction_radius**2 / np.maximum(self.distance, ARRIVED)
        turn = np.arctan2(lever, np.maximum(depth, reach))
        return fixed(inward + KEPT * drift + turn)

    @cached_property
    def turn(self) -> FloatArray:
        """Turn ``(m,)`` of the box from the goal pose [rad]."""
        return fixed(wrap(self.box[:, 2] - self.goal[2]))

    def azimuth(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` from a robot to the box [rad]."""
        pose = self.robots[:, robot]
        return np.arctan2(self.box[:, 1] - pose[:, 1], self.box[:, 0] - pose[:, 0])

    def inward(self, robot: int) -> FloatArray:
        """Direction ``(m,)`` into the box at the point of its surface next to a robot [rad]."""
        return _inward(self.robots[:, robot], self.box, self.outline.edges, self.outline.rounding)


def _direction(ways: FloatArray) -> FloatArray:
    """Return the directions ``(m,)`` of ways ``(m, 2)`` [rad], read-only."""
    return fixed(np.arctan2(ways[:, 1], ways[:, 0]))


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
