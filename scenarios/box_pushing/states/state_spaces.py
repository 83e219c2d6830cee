"""State spaces of box pushing.

The own variable of an agent is its wheel speed. The wheels of a robot share all others, which are
those of `variables`. A spec chooses a state space of `STATE_SPACES` by name, or lists shared
variables, built in or of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ....core.interface.spaces import StateSpace, Variable
from ....core.numerics import FloatArray, compile_ahead
from ...state_variables import StateVariable, find_variable, space_of
from ..world.geometry import BoxShape
from .kernel import Columns, columns_of, evaluate
from .situations import SituationBatch, whole_batch
from .variables import STATE_VARIABLES


@dataclass(frozen=True)
class BoxStateSpace:
    """A state space and how to compute it."""

    space: StateSpace
    """Names, ranges and membership centers."""
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

    def prepare_kernel(self, shape: BoxShape) -> None:
        """Begin to compile `evaluate` for these columns, if it is not cached."""
        poses = np.zeros((3, 1))
        batch = SituationBatch(poses[None], poses, poses[:1], poses[:, 0].copy(), poses, 1.0, shape)
        compile_ahead(evaluate, batch, np.zeros(1, np.int64), self.columns)

    def shared(self, batch: SituationBatch, robots: Sequence[int]) -> FloatArray:
        """Return the shared variables ``(k, m, d - 1)`` of k robots in m situations.

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


E_PUCK_SPEED = 0.13
"""Maximum wheel speed of the e-Puck [m/s]."""
_SPEED = Variable(
    "wheel_speed",
    "m/s",
    -E_PUCK_SPEED,
    E_PUCK_SPEED,
    centers=(-0.13, -0.065, 0.0, 0.065, 0.13),
    labels=("fast back", "back", "still", "forward", "fast forward"),
    mirrored="same",
)
_EVEN_DISTANCE = Variable("box_distance", "m", 0.0, 1.2, mirrored="same")
"""Distance of the box in the state of Eq. 1, with even membership functions."""
_PROGRESS = ("box_distance", "approach")
_PUSHING = ("gap", "box_bearing", "side", "others_gap", "cross_track_error", *_PROGRESS)
_TEAM = ("gap", "face_bearing", "side", "others_away")
_BOX = ("box_orientation", "box_goal_bearing", "box_distance")

STATE_SPACES: dict[str, tuple[str, ...]] = {
    # Eq. 1, and the same with the box as the goal of an agent.
    "paper": ("heading", "goal_bearing", "goal_distance", *_BOX),
    "paper-box": ("heading", "box_bearing", "robot_box_distance", *_BOX),
    # What matters for bringing the box to the goal, and for turning it into the goal pose besides.
    "relational": _PUSHING,
    "pose": (*_PUSHING, "bend", "box_turn"),
    # The same for boxes that are wide for a robot, and for any number of robots.
    "crowd": (*_TEAM, "contact_push_bearing", "contact_cross_track_error", *_PROGRESS),
    # For boxes so wide that they hardly turn on the way: the path of the box, not the push.
    "wide": (*_TEAM, "path_bearing", "path_cross_track_error", *_PROGRESS),
}
"""Shared variables of state spaces by the name that specs use."""


def state_space_for(
    chosen: str | tuple[str, ...], max_speed: float = E_PUCK_SPEED
) -> BoxStateSpace:
    """Return a state space, with the range of wheel speeds adapted to a robot.

    Parameters
    ----------
    chosen
        Key in `STATE_SPACES`, or names of state variables.
    max_speed
        Maximum wheel speed of the robot [m/s].

    Raises
    ------
    ValueError
        If there is no variable, or one is unknown or named twice.

    Examples
    --------
    >>> state_space_for("paper", 0.26).space.variables[0].centers
    (-0.26, -0.13, 0.0, 0.13, 0.26)
    """
    names = STATE_SPACES[chosen] if isinstance(chosen, str) else chosen
    shared = [find_variable(STATE_VARIABLES, name) for name in names]
    if chosen == "paper":
        shared[-1] = replace(shared[-1], variable=_EVEN_DISTANCE)
    factor = max_speed / E_PUCK_SPEED
    centers = tuple(factor * center for center in _SPEED.centers)
    speed = replace(_SPEED, low=factor * _SPEED.low, high=factor * _SPEED.high, centers=centers)
    name = chosen if isinstance(chosen, str) else "+".join(chosen)
    return BoxStateSpace(space_of(name, speed, shared), tuple(shared))
