"""State spaces of the box-pushing scenario: what a wheel agent perceives.

A state space pairs the description that learners see (`StateSpace`) with two functions that
compute it: the own block from the pose of the agent's robot and the speed of its wheel, the shared
block from the whole `View`. Both serve sensing and prediction alike and work on many situations at
once. A further state space is one `BoxStateSpace` and one line in `STATE_SPACES`; a spec may also
list the names of relational variables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from ....core.arrays import FloatArray
from ....core.spaces import StateSpace, Variable
from . import kernels as shared_blocks
from .relational import VARIABLES, angle
from .view import View, wrap


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
    columns
        Relational variables of the shared block, by their place in `relational.VARIABLES`;
        empty: `shared` is no such block.
    """

    space: StateSpace
    own: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    shared: Callable[[View, int], FloatArray]
    own_needs_pose: bool
    alike: bool = False
    columns: tuple[int, ...] = ()

    def shared_of(self, view: View, robots: Sequence[int]) -> list[FloatArray]:
        """Return the shared block ``(m, d - n_own)`` of each robot, fast for many situations."""
        if self.alike:
            return [self.shared(view, robots[0])] * len(robots)
        if not self.columns:
            return [self.shared(view, r) for r in robots]
        blocks = shared_blocks.relational(
            np.ascontiguousarray(view.robots.transpose(1, 2, 0)),
            np.ascontiguousarray(view.box.T), np.ascontiguousarray(view.gaps.T),
            view.goal, view.before, view.periods, np.array(robots), np.array(self.columns),
        )  # fmt: skip
        return list(blocks)


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
)


def relational(name: str, *shared: str) -> BoxStateSpace:
    """Return a state space of relational variables by name, behind the speed of the own wheel.

    Raises
    ------
    ValueError
        If there is none, one is unknown or named twice.
    """
    for variable in shared:
        if variable not in VARIABLES:
            raise ValueError(
                f"scenario.state_space: unknown variable {variable!r}, known: "
                f"{', '.join(VARIABLES)}"
            )
    if not shared or len(set(shared)) != len(shared):
        raise ValueError(
            f"scenario.state_space = {list(shared)}: variables must be distinct and at least one"
        )
    functions = [VARIABLES[variable][1] for variable in shared]
    return BoxStateSpace(
        StateSpace(name, (_SPEED, *(VARIABLES[variable][0] for variable in shared)), n_own=1),
        lambda poses, speeds, goal: speeds[:, None],
        lambda view, robot: np.stack([f(view, robot) for f in functions], axis=1),
        own_needs_pose=False,
        columns=tuple(list(VARIABLES).index(variable) for variable in shared),
    )


_PUSHING = ("gap", "box_bearing", "side", "others_gap", "miss", "box_distance", "approach")

STATE_SPACES: dict[str, BoxStateSpace] = {
    # Eq. 1, in the order of its own and its shared part.
    "paper": BoxStateSpace(
        StateSpace(
            "paper",
            (
                angle("heading", _EVEN, ()),
                angle("goal_bearing", _EVEN, ()),
                Variable("goal_distance", "m", 0.0, 1.5),
                _SPEED,
                angle("box_orientation", _EVEN, ()),
                angle("box_goal_bearing", _EVEN, ()),
                Variable("box_distance", "m", 0.0, 1.2),
            ),
            n_own=4,
        ),
        _paper_own,
        _paper_shared,
        own_needs_pose=True,
        alike=True,
    ),
    # What matters for bringing the box to the goal, and for turning it into the goal pose besides.
    "relational": relational("relational", *_PUSHING),
    "pose": relational("pose", *_PUSHING, "bend", "box_turn"),
}
"""State spaces by the name that specs use."""


def state_space_for(chosen: str | tuple[str, ...], max_speed: float) -> BoxStateSpace:
    """Return a state space, its wheel speeds laid over those of a robot.

    Parameters
    ----------
    chosen
        Key in `STATE_SPACES`, or names of relational variables.
    max_speed
        Greatest wheel speed of the robot [m/s].

    Examples
    --------
    >>> state_space_for("paper", 0.26).space.variables[3].centres
    (-0.26, -0.13, 0.0, 0.13, 0.26)
    """
    if isinstance(chosen, str):
        found = STATE_SPACES[chosen]
    else:
        found = relational("+".join(chosen), *chosen)
    factor = max_speed / _MAX_SPEED
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
