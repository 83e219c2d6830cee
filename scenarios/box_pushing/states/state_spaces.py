"""State spaces of box pushing.

The own variables of an agent are functions of its robot's pose and of its wheel speed. The shared
variables are those of `variables`. A spec chooses a state space of `STATE_SPACES` by name, or lists
shared variables, built in or of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Literal

import numpy as np

from ....core.interface.spaces import StateSpace, Variable
from ....core.numerics import FloatArray, wrap
from ...state_variables import StateVariable, find_variable, space_of
from .situations import SituationBatch, whole_batch
from .variables import STATE_VARIABLES, Columns, columns_of, evaluate


@dataclass(frozen=True)
class BoxStateSpace:
    """A state space and how to compute it."""

    space: StateSpace
    """Names, ranges and membership centers."""
    target: Literal["box", "goal"] | None
    """Target of the own variables of Eq. 1; None if the wheel speed is the only own variable."""
    variables: tuple[StateVariable, ...]
    """The shared variables, in order."""

    @cached_property
    def columns(self) -> Columns:
        """Columns of `evaluate`, one for each shared variable."""
        return columns_of(self.variables)

    @property
    def is_built_in(self) -> bool:
        """Whether all shared variables are built in."""
        return all(variable.trusted for variable in self.variables)

    @property
    def own_needs_pose(self) -> bool:
        """Whether own variables depend on the poses of robots and box."""
        return self.target is not None

    def own(
        self, poses: FloatArray, speeds: FloatArray, boxes: FloatArray, goal: FloatArray
    ) -> FloatArray:
        """Return the own variables ``(m, n_own)`` of agents.

        Parameters
        ----------
        poses, boxes
            ``(m, 3)`` of the robot and the box; anything unless `own_needs_pose`.
        speeds
            ``(m,)`` wheel speeds [m/s].
        goal
            ``(3,)`` goal pose of the box.
        """
        if self.target is None:
            return speeds[:, None]
        target = boxes if self.target == "box" else goal
        x, y = (target[..., :2] - poses[:, :2]).T
        heading = poses[:, 2]
        bearing = wrap(np.arctan2(y, x) - heading)
        return np.stack([wrap(heading), bearing, np.hypot(x, y), speeds], axis=1)

    def own_of_all(self, batch: SituationBatch, speeds: FloatArray) -> FloatArray:
        """Return the own variables ``(n, m, n_own)`` of all agents, given speeds ``(n, m)``."""
        n, _ = speeds.shape
        poses = boxes = batch.boxes.T
        if self.own_needs_pose:
            robots = batch.robots.transpose(0, 2, 1)
            poses = np.repeat(robots, n // len(robots), axis=0).reshape(-1, 3)
            boxes = np.tile(boxes, (n, 1))
        own = self.own(poses, speeds.reshape(-1), boxes, batch.goal)
        return own.reshape(*speeds.shape, -1)

    def shared(self, batch: SituationBatch, robots: Sequence[int]) -> FloatArray:
        """Return the shared variables ``(k, m, d - n_own)`` of k robots in m situations.

        Raises
        ------
        ValueError
            If a user's function returns anything but a finite number for each situation.
        """
        out = evaluate(batch, np.fromiter(robots, np.int64), self.columns)
        if not self.is_built_in:
            situation = whole_batch(batch)
            for column, variable in enumerate(self.variables):
                if not variable.trusted:
                    for k, robot in enumerate(robots):
                        values = variable.function(situation, situation.robots[robot])
                        out[k, :, column] = variable.checked(values, batch.boxes.shape[1])
        return out


_EVEN = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
_E_PUCK_SPEED = 0.13
_SPEED = Variable(
    "wheel_speed",
    "m/s",
    -_E_PUCK_SPEED,
    _E_PUCK_SPEED,
    centers=(-0.13, -0.065, 0.0, 0.065, 0.13),
    labels=("fast back", "back", "still", "forward", "fast forward"),
    mirrored="same",
)


def build_space(name: str, *shared: str) -> BoxStateSpace:
    """Return a state space of the own wheel speed and of shared variables by name.

    Raises
    ------
    ValueError
        If there is none, one is unknown or named twice.
    """
    variables = tuple(find_variable(STATE_VARIABLES, one) for one in shared)
    return BoxStateSpace(space_of(name, _SPEED, variables), None, variables)


def _space_of_paper(name: str) -> BoxStateSpace:
    """Return the state of Eq. 1, in the order of its own and its shared part.

    The goal of an agent is the goal of the box or, in ``paper-box``, the box itself.
    """
    is_box = name == "paper-box"
    bearing_name, distance_name = (
        ("box_bearing", "robot_box_distance") if is_box else ("goal_bearing", "goal_distance")
    )
    orientation, bearing, distance = (
        find_variable(STATE_VARIABLES, name)
        for name in ("box_orientation", "box_goal_bearing", "box_distance")
    )
    coarse = Variable("box_distance", "m", 0.0, 1.2, mirrored="same")
    shared = (orientation, bearing, replace(distance, variable=coarse))
    angles = (
        Variable(name, "rad", -pi, pi, True, centers, mirrored="opposite")
        for name, centers in (("heading", _EVEN), (bearing_name, ()))
    )
    goal_distance = Variable(distance_name, "m", 0.0, 1.5, mirrored="same")
    described = (*angles, goal_distance, _SPEED, *(each.variable for each in shared))
    common = tuple(each.variable.name for each in shared)
    space = StateSpace(name, described, n_own=4, common=common)
    return BoxStateSpace(space, "box" if is_box else "goal", shared)


_PROGRESS = ("box_distance", "approach")
_PUSHING = ("gap", "box_bearing", "side", "others_gap", "cross_track_error", *_PROGRESS)
_TEAM = ("gap", "face_bearing", "side", "others_away")

STATE_SPACES: dict[str, BoxStateSpace] = {
    "paper": _space_of_paper("paper"),
    "paper-box": _space_of_paper("paper-box"),
    # What matters for bringing the box to the goal, and for turning it into the goal pose besides.
    "relational": build_space("relational", *_PUSHING),
    "pose": build_space("pose", *_PUSHING, "bend", "box_turn"),
    # The same for boxes that are wide for a robot, and for any number of robots.
    "crowd": build_space(
        "crowd", *_TEAM, "contact_push_bearing", "contact_cross_track_error", *_PROGRESS
    ),
    # For boxes so wide that they hardly turn on the way: the path of the box, not the push.
    "wide": build_space("wide", *_TEAM, "path_bearing", "path_cross_track_error", *_PROGRESS),
}
"""State spaces by the name that specs use."""


def state_space_for(chosen: str | tuple[str, ...], max_speed: float) -> BoxStateSpace:
    """Return a state space, with the range of wheel speeds adapted to a robot.

    Parameters
    ----------
    chosen
        Key in `STATE_SPACES`, or names of state variables.
    max_speed
        Maximum wheel speed of the robot [m/s].

    Examples
    --------
    >>> state_space_for("paper", 0.26).space.variables[3].centers
    (-0.26, -0.13, 0.0, 0.13, 0.26)
    """
    space = (
        STATE_SPACES[chosen] if isinstance(chosen, str) else build_space("+".join(chosen), *chosen)
    )
    factor = max_speed / _E_PUCK_SPEED
    if factor == 1.0:
        return space
    centers = tuple(factor * center for center in _SPEED.centers)
    speed = replace(_SPEED, low=factor * _SPEED.low, high=factor * _SPEED.high, centers=centers)
    variables = tuple(speed if v.name == speed.name else v for v in space.space.variables)
    return replace(space, space=replace(space.space, variables=variables))
