"""State spaces of the box-pushing scenario: what a wheel agent perceives.

A state space pairs the description that learners see (`StateSpace`) with what computes it: the own
block a function of the pose of the agent's robot and the speed of its wheel, the shared block
variables, each a function of the whole `View`. They serve sensing and prediction alike and work on
many situations at once. A further state space is one `BoxStateSpace` and one line in
`STATE_SPACES`; a spec may also list state variables by name, one's own among them, see `variables`.

The shared blocks of many predicted situations are computed by `relational_lanes`, compiled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import pi

import numpy as np

from ....core.interface.spaces import StateSpace, Variable
from ....core.numerics import FloatArray, wrap
from ...state_variables import StateVariable, find_variable, sense, space_of
from .relational import STATE_VARIABLES, View
from .relational_lanes import Columns
from .sensing import sensed


@dataclass(frozen=True)
class BoxStateSpace:
    """A state space and how to compute it."""

    space: StateSpace
    """Names, ranges and membership centres."""
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    """``own(poses (m, 3), speeds (m,), goal (3,)) -> (m, n_own)``."""
    own_needs_pose: bool
    """Whether `own` reads the poses; if not, none need be predicted for it."""
    functions: tuple[StateVariable, ...]
    """The shared variables, in order."""
    columns: Columns | None = None
    """Computes the built-in ones fast for many situations; none: the functions do."""

    def sense(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the shared blocks ``(k, m, d - n_own)`` of k robots, by the functions alone."""
        return sense(self.functions, view, robots)

    def observe(self, view: View) -> FloatArray:
        """Return the shared blocks ``(m, M, d - n_own)`` of all robots, fast for few situations.

        They have the bits of `sense`.
        """
        robots = range(view.gaps.shape[1])
        if self.columns is None:
            return self.sense(view, robots).swapaxes(0, 1)
        shared = sensed(view, self.columns)
        if not self.is_built_in:
            users = [c for c, thing in enumerate(self.functions) if not thing.trusted]
            of_users = sense([self.functions[c] for c in users], view, robots)
            shared[:, :, users] = of_users.swapaxes(0, 1)
        return shared

    @property
    def is_built_in(self) -> bool:
        """Whether no variable is a user's."""
        return all(thing.trusted for thing in self.functions)

    def shared_of(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the shared blocks ``(k, m, d - n_own)`` of k robots, fast for many situations."""
        compiled = None if self.columns is None else self.columns.of(view, robots)
        return sense(self.functions, view, robots, compiled)


def _paper_own(poses: FloatArray, speeds: FloatArray, goal: FloatArray) -> FloatArray:
    x, y = (goal[:2] - poses[:, :2]).T
    heading = poses[:, 2]
    bearing = wrap(np.arctan2(y, x) - heading)
    return np.stack([wrap(heading), bearing, np.hypot(x, y), speeds], axis=1)


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


_shared = partial(StateVariable, common=True, trusted=True)


def build_space(name: str, *shared: str) -> BoxStateSpace:
    """Return a state space of variables by name, behind the speed of the own wheel.

    Raises
    ------
    ValueError
        If there is none, one is unknown or named twice.
    """
    functions = tuple(find_variable(STATE_VARIABLES, one) for one in shared)
    return BoxStateSpace(
        space_of(name, _SPEED, functions),
        lambda poses, speeds, goal: speeds[:, None],
        own_needs_pose=False,
        functions=functions,
        columns=Columns(shared),
    )


_PAPER = (
    _shared(_angle("box_orientation", _EVEN), lambda view, robot: wrap(view.box[:, 2])),
    _shared(
        _angle("box_goal_bearing", _EVEN), lambda view, robot: wrap(view.course - view.box[:, 2])
    ),
    _shared(
        Variable("box_distance", "m", 0.0, 1.2, mirrored="same"), lambda view, robot: view.distance
    ),
)

_ON_THE_WAY = ("box_distance", "approach")
_PUSHING = ("gap", "box_bearing", "side", "others_gap", "cross_track_error", *_ON_THE_WAY)
_BESIDE_OTHERS = ("gap", "face_bearing", "side", "others_away")

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
                *(function.variable for function in _PAPER),
            ),
            n_own=4,
            common=tuple(function.variable.name for function in _PAPER),
        ),
        _paper_own,
        own_needs_pose=True,
        functions=_PAPER,
    ),
    # What matters for bringing the box to the goal, and for turning it into the goal pose besides.
    "relational": build_space("relational", *_PUSHING),
    "pose": build_space("pose", *_PUSHING, "bend", "box_turn"),
    # The same for boxes that are wide for a robot, and for any number of robots.
    "crowd": build_space(
        "crowd", *_BESIDE_OTHERS, "contact_push_bearing", "contact_cross_track_error", *_ON_THE_WAY
    ),
    # For boxes so wide that they hardly turn on the way: where the box goes, not how it is pushed.
    "wide": build_space(
        "wide", *_BESIDE_OTHERS, "path_bearing", "path_cross_track_error", *_ON_THE_WAY
    ),
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
    space = (
        STATE_SPACES[chosen] if isinstance(chosen, str) else build_space("+".join(chosen), *chosen)
    )
    factor = max_speed / _MAX_SPEED
    if factor == 1.0:
        return space
    centres = tuple(factor * centre for centre in _SPEED.centres)
    speed = replace(_SPEED, low=factor * _SPEED.low, high=factor * _SPEED.high, centres=centres)
    variables = tuple(speed if v.name == speed.name else v for v in space.space.variables)
    return replace(space, space=replace(space.space, variables=variables))
