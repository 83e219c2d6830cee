"""Settings of box pushing, as in the ``[scenario]`` table of a spec."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ...core.learners.fitted_q import FittedQSettings
from ...core.plugins.settings import Positive, ScenarioSettings, Settings, team_size
from ...core.search.exploration import BurstExploration
from ..state_variables import names_of
from .prediction.settings import BeliefSettings
from .states.variables import STATE_VARIABLES
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


class LeaderSettings(Settings):
    """Leader above all robots, which decides between a straight push and a second side."""

    policy: Literal["none", "rule", "learned"] = "none"
    """Policy of the leader. With ``none`` there is no leader. With ``rule`` the robots push from a
    second side if the goal is more than 20 degrees off. With ``learned`` the leader learns this
    choice while all other agents keep their weights."""
    learner: FittedQSettings = FittedQSettings(
        discount=0.995,
        regression_iterations=60,
        exploration=BurstExploration(rate=0.5, decay=0.97, floor=0.05, length=1.0),
    )
    """Learner of the leader, see `learner` with `kind` fitted-q."""
    limit: Annotated[int, Field(ge=1)] = 300
    """Number of decisions after which an option ends."""
    quorum: Annotated[float, Field(gt=0, le=1)] = 0.6
    """Fraction of the robots that must stand at the second side before they push."""


WRITTEN = {
    "box_distance": -1.0,
    "contact_cross_track_error": -2.0,
    "gap": -0.5,
    "face_bearing": -0.02,
}
"""Weights of the preset `hand-written`, value per meter or radian: for the distance of the box
from the goal, the distance by which the push misses it, the gap, and the angle to the face."""


class BoxTaskSettings(ScenarioSettings):
    """Robots, box, task and servo layer, common to all scenarios of box pushing."""

    player: ClassVar[str] = f"{__package__}.pictures.player"
    robots: Annotated[int, Field(ge=1), team_size(7.5e-7, agents=2)] = 2
    """Number of robots, as many as memory and time allow by estimate."""
    robot: str | RobotSettings = "e-puck"
    """Robot by name, or a table that describes one."""
    box: str | BoxSettings = "square"
    """Box by name, or a table that describes one."""
    infrared: InfraredSettings = InfraredSettings()
    """Response of the infrared sensors of all robots."""
    start: Literal["fixed", "easy", "medium", "hard"] = "medium"
    """Distribution of start poses: how far off the course to the goal robots and box begin. With
    ``fixed`` every episode starts in the same poses, on the course."""
    scaling: Literal["fixed", "similar"] = "fixed"
    """How lengths of the task depend on the number of robots. With ``fixed`` the distance of the
    box to the goal, `tolerance`, `termination_radius` and r1 of the reward are the same for all
    teams. With ``similar`` the lengths grow with the box, and r1 falls in proportion."""
    failures: tuple[Failure, ...] = ()
    """Failures of wheels, as ``[[scenario.failures]]`` tables."""
    action_repeat: Periods = 8
    """Control periods of 64 ms for which a decision is held."""
    speed_increment: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Change of wheel speed by the actions increase and decrease, as a fraction of the maximum."""
    tolerance: Positive = 0.05
    """Distance of the box from the goal that counts as reached [m]."""
    termination_radius: Positive = 1.5
    """Distance of the box from the goal [m] beyond which an episode ends."""
    orientation_tolerance: Positive | None = None
    """Orientation error that still counts as reached [rad]. Without a value any orientation does.
    With a value, results contain the orientation error at the end of each episode."""

    @property
    def task_size(self) -> float:
        """Size of the box relative to that of two robots."""
        from .world.boxes import growth  # shapely takes its time

        return growth(self.box, self.robots)

    @property
    def period(self) -> float:
        """Seconds for which a decision is held."""
        return self.action_repeat * CONTROL_PERIOD

    @property
    def drawing(self) -> dict[str, float | str]:
        """Constants that a recording needs, besides the motions, to be drawn."""
        named = {"robot": self.robot, "box": self.box, "infrared": self.infrared}
        return {"dt": self.period} | {name: label(thing) for name, thing in named.items()}


class BoxPushingSettings(BoxTaskSettings):
    """The box-pushing scenario (Section IX)."""

    kind: Literal["box-pushing"] = "box-pushing"
    factory: ClassVar[str] = f"{__package__}.leading:built"
    state_space: Annotated[
        Literal["paper", "paper-box", "relational", "pose", "crowd", "wide"] | tuple[str, ...],
        names_of(STATE_VARIABLES),
    ] = "relational"
    """Built-in state space by name, or a list of state variables by name, built in or user-defined.
    ``paper`` is Eq. 1; in ``paper-box`` the goal of an agent (phi_i and d_i) is the box."""
    predictor: Literal["push", "rigid", "static", "exact"] = "push"
    """Model of predictions: robots that yield to the box (``push``), robots that do not
    (``rigid``), a box that does not move (``static``), or the simulation itself (``exact``)."""
    belief: BeliefSettings = BeliefSettings()
    """Errors of the constants that the predictor `push` assumes and robots cannot observe."""
    reward: RewardSettings = RewardSettings()
    """Constants of the reward; `of` selects whether the team or each robot is rewarded."""
    prediction_horizon: Periods = 24
    """Number of control periods that a prediction looks ahead while the decision is held. Choose it
    long enough that different actions lead to different states."""

    leader: LeaderSettings = LeaderSettings()
    """Leader above all robots."""

    @model_validator(mode="after")
    def _believes(self) -> Self:
        if self.predictor != "push" and self.belief != BeliefSettings():
            raise ValueError(f"belief is for predictor = 'push', received {self.predictor!r}")
        return self

    def scenario_defaults(self, preset: str) -> Mapping[str, object]:
        """Return the best settings for learning; up to two robots, each wheel has its own weights.

        Two robots stand on different sides of the box and need different functions; larger teams
        learn sooner if all left wheels share theirs, and all right wheels. A written value is
        `WRITTEN`.
        """
        if preset == "hand-written":
            return {"learner": {"value": WRITTEN}}
        if preset == "default" and self.robots <= 2:
            return {"learner": {"weights": "own"}}
        return {}
