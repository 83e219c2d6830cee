"""The settings of box pushing, as they stand in the ``[scenario]`` table of a spec."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from ...core.plugins.settings import Positive, ScenarioSettings, team_size
from ..state_variables import referred
from .prediction.settings import BeliefSettings
from .states.variables import STATE_VARIABLES
from .world import units
from .world.settings import (
    CONTROL_PERIOD,
    BoxSettings,
    Failure,
    InfraredSettings,
    Periods,
    RewardSettings,
    RobotSettings,
    label,
)


class BoxTaskSettings(ScenarioSettings):
    """Robots, box, task and servo layer: what all scenarios of box pushing have in common."""

    player: ClassVar[str] = f"{__package__}.pictures.player"
    robots: Annotated[int, Field(ge=1), team_size(7.5e-7, agents=2)] = 2
    """Number of robots, as many as memory and time allow by estimate."""
    robot: str | RobotSettings = "e-puck"
    """Robot by name, or a table that describes one."""
    box: str | BoxSettings = "square"
    """Box by name, or a table that describes one."""
    infrared: InfraredSettings = InfraredSettings()
    """How the infrared sensors of all robots read."""
    start: Literal["easy", "medium", "hard"] = "medium"
    """Distribution of start poses: how far off the course to the goal robots and box begin."""
    scaling: Literal["fixed", "similar"] = "fixed"
    """Whether the box's distance to the goal, `tolerance`, `termination_radius` and the reward's r1
    stay as they are whatever the number of robots, or are in units of the box and grow with it."""
    failures: tuple[Failure, ...] = ()
    """Failures of wheels, as ``[[scenario.failures]]`` tables."""
    action_repeat: Periods = 8
    """Control periods of 64 ms for which a decision is held."""
    speed_increment: Annotated[float, Field(gt=0, le=1)] = 0.5
    """What increase and decrease change, as a fraction of the greatest wheel speed."""
    tolerance: Positive = 0.05
    """Distance of the box from the goal that counts as reached [m]."""
    termination_radius: Positive = 1.5
    """Distance of the box from the goal [m] beyond which an episode is broken off."""
    orientation_tolerance: Positive | None = None
    """Orientation error that still counts as reached [rad]; none: any."""

    def warnings(self) -> tuple[str, ...]:
        """Return sizes that are probably given in another unit, a line each.

        Examples
        --------
        >>> BoxPushingSettings(infrared={"reach": 60.0}).warnings()
        ('scenario.infrared.reach = 60 m: perhaps meant in mm, 0.06 m',)
        """
        return tuple(units.warnings(self))

    @property
    def period(self) -> float:
        """Seconds for which a decision is held."""
        return self.action_repeat * CONTROL_PERIOD

    @property
    def drawn(self) -> dict[str, float | str]:
        """What a recording must tell beside motions, so that it can be drawn."""
        named = {"robot": self.robot, "box": self.box, "infrared": self.infrared}
        return {"dt": self.period} | {name: label(thing) for name, thing in named.items()}


class BoxPushingSettings(BoxTaskSettings):
    """The box-pushing scenario (Section IX)."""

    kind: Literal["box-pushing"] = "box-pushing"
    factory: ClassVar[str] = f"{__package__}.scenario:BoxPushing"
    state_space: Literal["paper", "relational", "pose", "crowd", "wide"] | tuple[str, ...] = (
        "relational"
    )
    """Eq. 1, the relational variables, those and the orientation of the box, or state variables by
    name, one's own included."""
    predictor: Literal["push", "rigid", "static", "exact"] = "push"
    """What predictions take the world for: robots that yield to the box, robots that do not
    (``rigid``), a box that does not move (``static``), or the world itself."""
    belief: BeliefSettings = BeliefSettings()
    """Which constants that robots cannot see the predictor `push` knows."""
    reward: RewardSettings = RewardSettings()
    """The constants of the reward, and whose contact it asks for."""
    prediction_horizon: Periods = 24
    """Control periods that predictions look ahead, the decision being held for all of them: so far
    that what agents do shows."""

    @field_validator("state_space", mode="before")
    @classmethod
    def _by_name(cls, value: object) -> object:
        return referred(STATE_VARIABLES, value)

    @model_validator(mode="after")
    def _believes(self) -> Self:
        if self.predictor != "push" and self.belief != BeliefSettings():
            raise ValueError(f"belief is for predictor = 'push', received {self.predictor!r}")
        return self

    def scenario_defaults(self, preset: str) -> Mapping[str, Any]:
        """Return what learns best here: with one or two robots, every wheel by weights of its own.

        Two robots stand on different sides of the box and need different functions; larger teams
        learn sooner if all left wheels share theirs, and all right wheels.
        """
        return {"learner": {"weights": "own"}} if preset == "default" and self.robots <= 2 else {}
