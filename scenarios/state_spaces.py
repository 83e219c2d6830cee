"""State spaces of the box-pushing scenario: what a wheel agent perceives.

A state space pairs the description that learners see (`StateSpace`) with two functions that
compute it: the own block from the pose of the agent's robot and the speed of its wheel, the shared
block from the whole `View`. Both serve sensing and prediction alike and work on many situations at
once. A further state space is one `BoxStateSpace` and one line in `STATE_SPACES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np

from ..core.arrays import FloatArray
from ..core.spaces import StateSpace, Variable
from . import shared_blocks


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

    # What all robots share is computed once.

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the box from the goal [m]."""
        ahead = self.goal[:2] - self.box[:, :2]
        return np.hypot(ahead[:, 0], ahead[:, 1])

    @cached_property
    def course(self) -> FloatArray:
        """Direction ``(m,)`` from the box to the goal [rad]."""
        return np.arctan2(self.goal[1] - self.box[:, 1], self.goal[0] - self.box[:, 0])

    @cached_property
    def bearings(self) -> FloatArray:
        """Where the robots' middle would push the box, off the course, and its turn ``(m, 2)``."""
        middle = self.robots[:, :, :2].mean(axis=1)
        push = np.arctan2(self.box[:, 1] - middle[:, 1], self.box[:, 0] - middle[:, 0])
        return wrap(np.stack([push - self.course, self.box[:, 2] - self.goal[2]], axis=1))


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
    alike
        Whether the shared block is the same for all robots.
    compiled
        ``compiled(robots (M, 3, m), box (3, m), gaps (M, m), goal, robots wanted (k,)) ->
        (k, m, d - n_own)``: what `shared` returns, for predictions; none: `shared` serves.
    """

    space: StateSpace
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    shared: Callable[[View, int], FloatArray]
    own_needs_pose: bool
    alike: bool = False
    compiled: Callable[..., FloatArray] | None = None

    def shared_of(self, view: View, robots: Sequence[int]) -> list[FloatArray]:
        """Return the shared block ``(m, d - n_own)`` of each robot, fast for many situations."""
        if self.alike:
            return [self.shared(view, robots[0])] * len(robots)
        if self.compiled is None:
            return [self.shared(view, r) for r in robots]
        blocks = self.compiled(
            np.ascontiguousarray(view.robots.transpose(1, 2, 0)),
            np.ascontiguousarray(view.box.T), np.ascontiguousarray(view.gaps.T),
            view.goal, np.array(robots),
        )  # fmt: skip
        return list(blocks)


_TURN = 2.0 * pi
_TURN_HIGH = 6.283185243606567
"""The leading 26 bits of a turn: products with a few thousand turns are exact."""
_TURN_LOW = _TURN - _TURN_HIGH


def wrap(angle: FloatArray) -> FloatArray:
    """Map angles to [-pi, pi): ``(angle + pi) % (2 pi) - pi`` to the last bit, but faster."""
    shifted = angle + pi
    turns = np.floor(shifted / _TURN)
    return shifted - turns * _TURN_HIGH - turns * _TURN_LOW - pi


def _paper_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    ahead = goal[:2] - poses[:, :2]
    bearing = np.arctan2(ahead[:, 1], ahead[:, 0])
    distance = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.stack([wrap(poses[:, 2]), wrap(bearing - poses[:, 2]), distance, speeds], axis=1)


def _paper_shared(view: View, robot: int) -> FloatArray:
    turned = view.box[:, 2]
    return np.stack([wrap(turned), wrap(view.course - turned), view.distance], axis=1)


def _relational_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    return speeds[:, None]


def _relational_shared(view: View, robot: int) -> FloatArray:
    pose, box = view.robots[:, robot], view.box
    azimuth = np.arctan2(box[:, 1] - pose[:, 1], box[:, 0] - pose[:, 0])
    others = [r for r in range(view.gaps.shape[1]) if r != robot] or [robot]
    block = np.empty((len(pose), 7))
    block[:, 0] = view.gaps[:, robot]
    block[:, 1] = azimuth - pose[:, 2]
    block[:, 2] = azimuth - view.course
    block[:, 1:3] = wrap(block[:, 1:3])
    block[:, 3] = view.gaps[:, others].max(axis=1)
    block[:, 4:6] = view.bearings
    block[:, 6] = view.distance
    return block


def _angle(name: str, centres: tuple[float, ...], labels: tuple[str, ...]) -> Variable:
    return Variable(name, "rad", -pi, pi, True, centres, labels)


_SIDES = (-2.2, -0.5, 0.0, 0.5, 2.2)
_EVEN = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
_GAPS = (0.0, 0.015, 0.06, 0.2, 0.5)
_NEARNESS = ("touching", "close", "near", "away", "far")
_TURNS = ("far right", "right", "ahead", "left", "far left")
_MAX_SPEED = 0.13  # the e-Puck's; `state_space_for` lays it over that of other robots
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
        alike=True,
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
        compiled=shared_blocks.relational,
    ),
}
"""State spaces by the name that specs use."""


def state_space_for(name: str, max_speed: float) -> BoxStateSpace:
    """Return a state space, its wheel speeds laid over those of a robot.

    Parameters
    ----------
    name
        Key in `STATE_SPACES`.
    max_speed
        Greatest wheel speed of the robot [m/s].

    Examples
    --------
    >>> state_space_for("paper", 0.26).space.variables[3].centres
    (-0.26, -0.13, 0.0, 0.13, 0.26)
    """
    found, factor = STATE_SPACES[name], max_speed / _MAX_SPEED
    if factor == 1.0:
        return found
    variables = tuple(
        replace(
            variable,
            low=factor * variable.low,
            high=factor * variable.high,
            centres=tuple(factor * centre for centre in variable.centres),
        )
        if variable.name == _SPEED.name
        else variable
        for variable in found.space.variables
    )
    return replace(found, space=replace(found.space, variables=variables))
