"""State spaces of box pushing.

The own variables of an agent are functions of its robot's pose and of its wheel speed. The shared
variables are those of `variables`. A spec chooses a state space of `STATE_SPACES` by name, or lists
shared variables, built in or of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

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
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    """``own(poses (m, 3), speeds (m,), goal (3,)) -> (m, n_own)``."""
    own_needs_pose: bool
    """Whether `own` depends on the poses."""
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


def _own_of_paper(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    """Return theta_i, phi_i, d_i and omega_i of Eq. 1."""
    x, y = (goal[:2] - poses[:, :2]).T
    heading = poses[:, 2]
    bearing = wrap(np.arctan2(y, x) - heading)
    return np.stack([wrap(heading), bearing, np.hypot(x, y), speeds], axis=1)


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
    return BoxStateSpace(
        space_of(name, _SPEED, variables),
        lambda poses, speeds, goal: speeds[:, None],
        own_needs_pose=False,
        variables=variables,
    )


def _space_of_paper() -> BoxStateSpace:
    """Return the state of Eq. 1, in the order of its own and its shared part."""
    orientation, bearing, distance = (
        find_variable(STATE_VARIABLES, name)
        for name in ("box_orientation", "box_goal_bearing", "box_distance")
    )
    coarse = Variable("box_distance", "m", 0.0, 1.2, mirrored="same")
    shared = (orientation, bearing, replace(distance, variable=coarse))
    angles = (
        Variable(name, "rad", -pi, pi, True, centers, mirrored="opposite")
        for name, centers in (("heading", _EVEN), ("goal_bearing", ()))
    )
    goal_distance = Variable("goal_distance", "m", 0.0, 1.5, mirrored="same")
    described = (*angles, goal_distance, _SPEED, *(each.variable for each in shared))
    common = tuple(each.variable.name for each in shared)
    space = StateSpace("paper", described, n_own=4, common=common)
    return BoxStateSpace(space, _own_of_paper, own_needs_pose=True, variables=shared)


_PROGRESS = ("box_distance", "approach")
_PUSHING = ("gap", "box_bearing", "side", "others_gap", "cross_track_error", *_PROGRESS)
_TEAM = ("gap", "face_bearing", "side", "others_away")

STATE_SPACES: dict[str, BoxStateSpace] = {
    "paper": _space_of_paper(),
    # The same with the box as the goal of an agent. Others move the box, so only the speed is own.
    "paper-box": build_space(
        "paper-box",
        "heading",
        "box_bearing",
        "robot_box_distance",
        "box_orientation",
        "box_goal_bearing",
        "box_distance",
    ),
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
