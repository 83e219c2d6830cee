"""State spaces of the box-pushing scenario: what a wheel agent perceives.

A state space pairs the description that learners see (`StateSpace`) with two functions that
compute it: the own block from the pose of the agent's robot and the speed of its wheel, the shared
block from the whole `View`. Both serve sensing and prediction alike and work on many situations at
once. A further state space is one `BoxStateSpace` and one line in `STATE_SPACES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from ..core.arrays import FloatArray
from ..core.spaces import StateSpace, Variable


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
    """

    robots: FloatArray
    box: FloatArray
    gaps: FloatArray
    goal: FloatArray


@dataclass(frozen=True)
class BoxStateSpace:
    """A state space and how to compute it.

    Attributes
    ----------
    space
        Names, ranges and membership centres.
    own
        ``own(poses (m, 3), speeds (m,), goal (3,)) -> (m, n_own)``.
    shared
        ``shared(view, robot) -> (m, d - n_own)`` for the agents of one robot.
    own_needs_pose
        Whether `own` reads the poses; if not, none need be predicted for it.
    """

    space: StateSpace
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    shared: Callable[[View, int], FloatArray]
    own_needs_pose: bool


def wrap(angle: FloatArray) -> FloatArray:
    """Map angles to [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi


def _paper_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    ahead = goal[:2] - poses[:, :2]
    bearing = np.arctan2(ahead[:, 1], ahead[:, 0])
    distance = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.stack([wrap(poses[:, 2]), wrap(bearing - poses[:, 2]), distance, speeds], axis=1)


def _paper_shared(view: View, robot: int) -> FloatArray:
    ahead = view.goal[:2] - view.box[:, :2]
    bearing = np.arctan2(ahead[:, 1], ahead[:, 0])
    distance = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.stack([wrap(view.box[:, 2]), wrap(bearing - view.box[:, 2]), distance], axis=1)


def _relational_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    return speeds[:, None]


def _relational_shared(view: View, robot: int) -> FloatArray:
    pose, box, goal = view.robots[:, robot], view.box, view.goal
    to_box = box[:, :2] - pose[:, :2]
    to_goal = goal[:2] - box[:, :2]
    azimuth = np.arctan2(to_box[:, 1], to_box[:, 0])
    course = np.arctan2(to_goal[:, 1], to_goal[:, 0])
    others = np.delete(view.gaps, robot, axis=1)
    pushed = box[:, :2] - view.robots[:, :, :2].mean(axis=1)
    return np.stack(
        [
            view.gaps[:, robot],
            wrap(azimuth - pose[:, 2]),
            wrap(azimuth - course),
            others.max(axis=1) if others.shape[1] else view.gaps[:, robot],
            wrap(np.arctan2(pushed[:, 1], pushed[:, 0]) - course),
            wrap(box[:, 2] - goal[2]),
            np.hypot(to_goal[:, 0], to_goal[:, 1]),
        ],
        axis=1,
    )


def _angle(name: str, centres: tuple[float, ...], labels: tuple[str, ...]) -> Variable:
    return Variable(name, "rad", -pi, pi, True, centres, labels)


_SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
_EVEN = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
_GAPS = (0.0, 0.015, 0.06, 0.2, 0.5)
_NEARNESS = ("touching", "close", "near", "away", "far")
_TURNS = ("far right", "right", "ahead", "left", "far left")
_MAX_SPEED = 0.13
_SPEED = Variable(
    "wheel_speed",
    "m/s",
    -_MAX_SPEED,
    _MAX_SPEED,
    centres=(-0.13, -0.065, 0.0, 0.065, 0.13),
    labels=("fast back", "back", "still", "forward", "fast forward"),
)
_DISTANCE = Variable(
    "box_distance",
    "m",
    0.0,
    1.1,
    centres=(0.0, 0.1, 0.3, 0.6, 1.1),
    labels=("there", "close", "near", "away", "far"),
)

STATE_SPACES: dict[str, BoxStateSpace] = {
    # Eq. 1, in the order of its own and its shared part.
    "paper": BoxStateSpace(
        StateSpace(
            "paper",
            (
                _angle("heading", _EVEN, ()),
                _angle("goal_bearing", _EVEN, ()),
                Variable("goal_distance", "m", 0.0, 1.5),
                _SPEED,
                _angle("box_orientation", _EVEN, ()),
                _angle("box_goal_bearing", _EVEN, ()),
                Variable("box_distance", "m", 0.0, 1.2),
            ),
            n_own=4,
        ),
        _paper_own,
        _paper_shared,
        own_needs_pose=True,
    ),
    # What matters for pushing, seen from one robot: where it stands (gap, bearing of the box,
    # side of the box as seen along the course to the goal), how far off the others are, where the
    # robots' middle would push the box relative to the course, how the box is turned relative to
    # the goal pose, and how far it has to go.
    "relational": BoxStateSpace(
        StateSpace(
            "relational",
            (
                _SPEED,
                Variable("gap", "m", 0.0, 0.5, centres=_GAPS, labels=_NEARNESS),
                _angle("box_bearing", _SIDES, _TURNS),
                _angle("side", _SIDES, ("far left", "left", "behind", "right", "far right")),
                Variable("others_gap", "m", 0.0, 0.5, centres=_GAPS, labels=_NEARNESS),
                _angle("push_bearing", _SIDES, _TURNS),
                _angle("box_turn", _SIDES, _TURNS),
                _DISTANCE,
            ),
            n_own=1,
        ),
        _relational_own,
        _relational_shared,
        own_needs_pose=False,
    ),
}
"""State spaces by the name that specs use."""
