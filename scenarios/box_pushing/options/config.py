"""The settings of box pushing by pushing points."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from ....core.plugins.settings import Positive
from ..config import BoxTaskSettings

CONTROLS = ("frozen", "random", "planner")
"""Presets that do not learn."""


class PushingPointsSettings(BoxTaskSettings):
    """Box pushing with one agent per robot, whose actions are pushing points on the box."""

    kind: Literal["pushing-points"] = "pushing-points"
    factory: ClassVar[str] = f"{__package__}.scenario:PushingPoints"
    points: Annotated[int, Field(ge=2, le=26)] = 8
    """Pushing points, spread evenly around the outline of the box."""
    option_length: Annotated[int, Field(ge=1, le=1000)] = 8
    """Decision periods for which a robot keeps to the point that it has chosen."""
    longest: Annotated[int, Field(ge=1, le=1_000_000)] = 450
    """Decision periods after which an episode is broken off."""
    bearings: Annotated[int, Field(ge=3, le=360)] = 12
    """Membership functions of the bearing of the goal."""
    observed: Literal["own", "joint"] = "own"
    """Whether the value that an agent learns is of its own pushing point (each robot by itself), or
    of those of all robots (as a team)."""
    goal_reward: Positive = 1.0
    """Reward of all robots for reaching the goal; any other option pays by how much nearer the box
    came [m]."""

    @property
    def period(self) -> float:
        """Seconds for which a decision is held: those of an option."""
        return self.option_length * super().period

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return Q-learning over pushing points, of every robot alone or of the joint choice."""
        topology = "independent" if self.observed == "own" else "chain"
        learner: dict[str, Any] = {"rule_base": {"order": "full"}}
        if preset not in CONTROLS:
            learner |= {
                "kind": "q-learning",
                "discount": 0.8,
                "weights": "own",
                "exploration": {"kind": "burst", "rate": 0.6, "decay": 0.85, "length": 1.0},
                "decision": {"value_of": "own"},
            }
        return {"topology": {"kind": topology}, "learner": learner}
