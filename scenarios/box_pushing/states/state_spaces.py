"""State spaces of the box-pushing scenario: what a wheel agent perceives.

A state space pairs the description that learners see (`StateSpace`) with two functions that
compute it: the own block from the pose of the agent's robot and the speed of its wheel, the shared
block from the whole `View`. Both serve sensing and prediction alike and work on many situations at
once. A further state space is one `BoxStateSpace` and one line in `STATE_SPACES`; a spec may also
list state variables by name, one's own among them, see `variables`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from ....core.interface.spaces import StateSpace, Variable
from ....core.numerics.arrays import FloatArray
from ...state_variables import found, sensed
from ..world.geometry import wrap
from .kernels import COMPILED, Columns
from .variables import STATE_VARIABLES
from .view import View


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
    listed
        Shared variables that stand side by side, if the shared block is such a list.
    """

    space: StateSpace
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    shared: Callable[[View, int], FloatArray]
    own_needs_pose: bool
    alike: bool = False
    listed: Listed | None = None

    def sensed(self, view: View) -> FloatArray:
        """Return the shared blocks ``(M, m, d - n_own)`` of all robots, by the functions alone."""
        robots = range(view.robots.shape[1])
        if self.listed is not None:
            return self.listed.sensed(view, robots)
        return self.shared_of(view, robots)

    def shared_of(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the shared blocks ``(k, m, d - n_own)`` of k robots, fast for many situations."""
        if self.alike:
            return np.stack([self.shared(view, robots[0])] * len(robots))
        if self.listed is None:
            return np.stack([self.shared(view, r) for r in robots])
        return self.listed.predicted(view, robots)

    def is_own(self, variable: str) -> bool:
        """Return whether a variable is one of the user's own, of which nothing else is known."""
        own = () if self.listed is None else self.listed.functions
        return variable in [function.variable.name for function in own]


class Listed:
    """Shared variables in the order in which they are listed.

    Parameters
    ----------
    names
        Of the variables, see `variables.STATE_VARIABLES`. The compiled ones are trusted; what
        functions of users return is checked.

    Raises
    ------
    ValueError
        If one is unknown; one line.
    """

    def __init__(self, names: Sequence[str]) -> None:
        things = [found(STATE_VARIABLES, name) for name in names]
        is_compiled = np.array([name in COMPILED for name in names], dtype=bool)
        self.variables = tuple(thing.variable for thing in things)
        self.common = tuple(thing.variable.name for thing in things if thing.common)
        self.functions = tuple(thing for thing, c in zip(things, is_compiled, strict=True) if not c)
        self._things, self._trusted = things, is_compiled.tolist()
        # The columns of what is compiled, and of functions of users.
        self._compiled, self._own = np.flatnonzero(is_compiled), np.flatnonzero(~is_compiled)
        self._columns = Columns([name for name in names if name in COMPILED])

    def sensed(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the shared blocks ``(k, m, variables)`` of robots, by the functions alone."""
        return sensed(self._things, self._trusted, view, robots)

    def predicted(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the shared blocks ``(k, m, variables)`` of robots, compiled where it can be."""
        compiled = self._columns.of(view, robots)
        if not self.functions:
            return compiled
        blocks = np.empty((len(robots), len(view.box), len(self._things)))
        blocks[:, :, self._compiled] = compiled
        guarded = view.guarded()
        # Every robot is asked, so that `check` finds what is wrongly called common.
        for block, robot in zip(blocks, robots, strict=True):
            for column, function in zip(self._own, self.functions, strict=True):
                block[:, column] = function.checked(guarded, robot)
        return blocks


def _paper_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    ahead = goal[:2] - poses[:, :2]
    bearing = np.arctan2(ahead[:, 1], ahead[:, 0])
    distance = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.stack([wrap(poses[:, 2]), wrap(bearing - poses[:, 2]), distance, speeds], axis=1)


def _paper_shared(view: View, robot: int) -> FloatArray:
    turned = view.box[:, 2]
    return np.stack([wrap(turned), wrap(view.course - turned), view.distance], axis=1)


_EVEN = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
_MAX_SPEED = 0.13  # the e-Puck's; `state_space_for` lays it over that of other robots
_SPEED = Variable(
    "wheel_speed",
    "m/s",
    -_MAX_SPEED,
    _MAX_SPEED,
    centres=(-0.13, -0.065, 0.0, 0.065, 0.13),
    labels=("fast back", "back", "still", "forward", "fast forward"),
    mirrored="same",
)


def _angle(name: str, centres: tuple[float, ...] = ()) -> Variable:
    return Variable(name, "rad", -pi, pi, True, centres, mirrored="opposite")


def listed(name: str, *shared: str) -> BoxStateSpace:
    """Return a state space of variables by name, behind the speed of the own wheel.

    Raises
    ------
    ValueError
        If there is none, one is unknown or named twice.
    """
    variables = Listed(shared)
    names = [_SPEED.name, *(variable.name for variable in variables.variables)]
    if not shared or len(set(names)) != len(names):
        raise ValueError(
            f"scenario.state_space = {list(shared)}: variables must be distinct and at least one"
        )
    return BoxStateSpace(
        StateSpace(name, (_SPEED, *variables.variables), 1, variables.common),
        lambda poses, speeds, goal: speeds[:, None],
        lambda view, robot: variables.sensed(view, [robot])[0],
        own_needs_pose=False,
        listed=variables,
    )


_PUSHING = (
    "gap",
    "box_bearing",
    "side",
    "others_gap",
    "cross_track_error",
    "box_distance",
    "approach",
)

_PUSHING_TOGETHER = (
    "gap",
    "face_bearing",
    "side",
    "others_away",
    "contact_push_bearing",
    "contact_cross_track_error",
    "box_distance",
    "approach",
)

_STEERING = (
    "gap",
    "face_bearing",
    "side",
    "others_away",
    "path_bearing",
    "path_cross_track_error",
    "box_distance",
    "approach",
)

STATE_SPACES: dict[str, BoxStateSpace] = {
    # Eq. 1, in the order of its own and its shared part.
    "paper": BoxStateSpace(
        StateSpace(
            "paper",
            (
                _angle("heading", _EVEN),
                _angle("goal_bearing", _EVEN),
                Variable("goal_distance", "m", 0.0, 1.5, mirrored="same"),
                _SPEED,
                _angle("box_orientation", _EVEN),
                _angle("box_goal_bearing", _EVEN),
                Variable("box_distance", "m", 0.0, 1.2, mirrored="same"),
            ),
            n_own=4,
            common=("box_orientation", "box_goal_bearing", "box_distance"),
        ),
        _paper_own,
        _paper_shared,
        own_needs_pose=True,
        alike=True,
    ),
    # What matters for bringing the box to the goal, and for turning it into the goal pose besides.
    "relational": listed("relational", *_PUSHING),
    "pose": listed("pose", *_PUSHING, "bend", "box_turn"),
    # The same for boxes that are wide for a robot, and for any number of robots.
    "crowd": listed("crowd", *_PUSHING_TOGETHER),
    # For boxes so wide that they hardly turn on the way: where the box goes, not how it is pushed.
    "wide": listed("wide", *_STEERING),
}
"""State spaces by the name that specs use."""


def state_space_for(chosen: str | tuple[str, ...], max_speed: float) -> BoxStateSpace:
    """Return a state space, its wheel speeds laid over those of a robot.

    Parameters
    ----------
    chosen
        Key in `STATE_SPACES`, or names of state variables.
    max_speed
        Greatest wheel speed of the robot [m/s].

    Examples
    --------
    >>> state_space_for("paper", 0.26).space.variables[3].centres
    (-0.26, -0.13, 0.0, 0.13, 0.26)
    """
    space = STATE_SPACES[chosen] if isinstance(chosen, str) else listed("+".join(chosen), *chosen)
    factor = max_speed / _MAX_SPEED
    if factor == 1.0:
        return space
    variables = tuple(
        replace(
            variable,
            low=factor * variable.low,
            high=factor * variable.high,
            centres=tuple(factor * centre for centre in variable.centres),
        )
        if variable.name == _SPEED.name
        else variable
        for variable in space.space.variables
    )
    return replace(space, space=replace(space.space, variables=variables))
