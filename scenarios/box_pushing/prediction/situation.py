"""What predictions of the push start from: the present, and what is the same in all of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ....core.interface.spaces import ActionSet
from ....core.numerics.arrays import FloatArray
from ..states.state_spaces import BoxStateSpace
from ..states.view import View
from ..world.geometry import Outline
from ..world.reward import Task
from ..world.settings import InfraredSettings
from .belief import PushBelief


@dataclass(frozen=True)
class Situation:
    """The present, as far as prediction needs it.

    Attributes
    ----------
    robots, box, goal
        Poses ``(M, 3)``, ``(3,)``, ``(3,)``.
    speeds
        ``(n,)`` commanded wheel speeds [m/s].
    effects
        Per robot ``(3, w + 1)``: twist in its frame = effect @ [wheel speeds, 1].
    groups
        Agents of each robot.
    """

    robots: FloatArray
    box: FloatArray
    goal: FloatArray
    speeds: FloatArray
    effects: tuple[FloatArray, ...]
    groups: tuple[tuple[int, ...], ...]

    @cached_property
    def places(self) -> list[tuple[int, int]]:
        """Robot of every agent, and which of its wheels the agent drives."""
        return [(r, wheel) for r, group in enumerate(self.groups) for wheel in range(len(group))]


@dataclass(frozen=True)
class Premises:
    """What all predictions of a scenario rest on.

    Attributes
    ----------
    belief
        Push models by constants, for `outcomes`.
    space
        State variables.
    action_set, increment, limits
        What actions tell the wheels: an increment is a fraction of the ``(n,)`` limits [m/s].
    task, infrared
        What is rewarded, and what the sensors read.
    outline
        Of the box.
    hold, seconds
        How long a decision stands, and how far predictions look ahead [s].
    """

    belief: PushBelief
    space: BoxStateSpace
    action_set: ActionSet
    increment: float
    limits: FloatArray
    task: Task
    infrared: InfraredSettings
    outline: Outline
    hold: float
    seconds: float

    def seen(
        self,
        situation: Situation,
        robots: FloatArray,
        box: FloatArray,
        gaps: FloatArray,
        seconds: float,
    ) -> View:
        """Return a view of situations that `situation` leads to in `seconds`."""
        return View(
            robots, box, gaps, situation.goal, situation.box, seconds / self.hold,
            self.outline, self.belief.model.friction_radius,
        )  # fmt: skip
