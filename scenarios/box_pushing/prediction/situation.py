"""What predictions of the push start from: the present, and what is the same in all of them."""

from dataclasses import dataclass
from functools import cached_property

from ....core.interface.spaces import ActionSet
from ....core.numerics import FloatArray
from ..states.relational import View
from ..states.state_spaces import BoxStateSpace
from ..world.geometry import Outline
from ..world.settings import InfraredSettings, Task
from .belief import PushBelief


@dataclass(frozen=True)
class Situation:
    """The present, as far as prediction needs it."""

    robots: FloatArray
    """Poses ``(M, 3)``."""
    box: FloatArray
    """Pose ``(3,)``."""
    goal: FloatArray
    """Pose ``(3,)``."""
    speeds: FloatArray
    """``(n,)`` commanded wheel speeds [m/s]."""
    effects: tuple[FloatArray, ...]
    """Per robot ``(3, w + 1)``: twist in its frame = effect @ [wheel speeds, 1]."""
    groups: tuple[tuple[int, ...], ...]
    """Agents of each robot."""

    @cached_property
    def places(self) -> list[tuple[int, int]]:
        """Robot of every agent, and which of its wheels the agent drives."""
        return [(r, wheel) for r, group in enumerate(self.groups) for wheel in range(len(group))]


@dataclass(frozen=True)
class Premises:
    """What all predictions of a scenario rest on."""

    belief: PushBelief
    """Push models by constants, for `outcomes`."""
    space: BoxStateSpace
    """State variables."""
    action_set: ActionSet
    """What actions tell the wheels."""
    increment: float
    """By how much, as a fraction of `limits`."""
    limits: FloatArray
    """``(n,)`` greatest wheel speeds [m/s]."""
    task: Task
    """What is rewarded."""
    infrared: InfraredSettings
    """What the sensors read."""
    outline: Outline
    """Of the box."""
    hold: float
    """How long a decision stands [s]."""
    seconds: float
    """How far predictions look ahead [s]."""

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
