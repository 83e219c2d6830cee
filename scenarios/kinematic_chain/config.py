"""The settings of the kinematic chain, as they stand in the ``[scenario]`` table of a spec."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Union

from pydantic import Field

from ...core.plugins.settings import (
    Names,
    NonNegative,
    Positive,
    ScenarioSettings,
    Settings,
    team_size,
)
from ..faults.settings import DISCRIMINATOR, KINDS, FailureSettings, build_kinds
from ..state_variables import names_of
from .variables import CHAIN_VARIABLES

PERIOD = 0.1
"""Time between two decisions [s]."""
REACH = 1.0
"""Length of the whole arm [m]."""
RIDGE = 0.1
"""Ridge of a joint's regression that learns best, for every joint that shares its weights."""
SIMPLE = ("bearing", "distance", "approach")
"""State variables of which `kinematic_chain.responses` knows how they change."""
DISCOUNT = 0.8
"""Discount that learns best: a goal is some twenty decisions away."""


class ReachingRewardSettings(Settings):
    """The constants of the reward, in the spirit of Eq. 15-17; distances in metres.

    It is paid to all agents alike. Coming nearer must pay far less than being there: an arm that
    is paid for approaching alone learns to circle round the goal.
    """

    c1: NonNegative = 0.01
    """Reward at the goal."""
    c2: NonNegative = 0.003
    """Reward for coming nearer, times ``exp(-r2 distance)``."""
    r2: NonNegative = 1.5
    """Decay of that reward per metre of the tip's distance from the goal."""
    least_approach: NonNegative = 0.001
    """By how much the tip must have come nearer in a decision for that [m]."""
    receding: float = -0.005
    """Reward if the tip did not come nearer."""


class JointFailure(FailureSettings):
    """Joints that fail."""

    part: ClassVar[str] = "joints"

    joints: Names
    """Joints by agent name or pattern: ``joint2``, ``joint*``; one or a list."""


if TYPE_CHECKING:
    Failure = JointFailure
else:
    _ALIKE = {kind: KINDS[kind] for kind in ("weak", "reversed", "stuck")}
    _KINDS = build_kinds(JointFailure, locked=KINDS["seized"], **_ALIKE)
    Failure = Annotated[Union[*_KINDS.values()], DISCRIMINATOR]
"""Any failure's settings, distinguished by `kind`."""


class KinematicChainSettings(ScenarioSettings):
    """A planar arm of ``joints`` links of equal length, 1 m in all, its base at the origin."""

    kind: Literal["kinematic-chain"] = "kinematic-chain"
    factory: ClassVar[str] = f"{__package__}.scenario:KinematicChain"
    joints: Annotated[int, Field(ge=2), team_size(1e-8)] = 4
    """Number of joints, an agent each, as many as memory and time allow by estimate."""
    joint_limit: Annotated[float, Field(gt=0, le=3.141592653589793)] | None = None
    """Greatest angle of every joint but the base, either way [rad]; none: links pass each other."""
    failures: tuple[Failure, ...] = ()
    """Failures of joints, as ``[[scenario.failures]]`` tables."""
    predictor: Literal["nominal", "informed"] = "nominal"
    """Whether predictions take every joint for what it was built as, or know of failures."""
    state_space: Annotated[tuple[str, ...], names_of(CHAIN_VARIABLES)] = SIMPLE
    """State variables beside the speed of the own joint, by name, one's own included; see
    `kinematic_chain.variables`."""
    reward: ReachingRewardSettings = ReachingRewardSettings()
    """The constants of the reward."""
    speed: Positive = 0.6
    """Greatest speed of a joint [rad/s], in arms of few joints; in others 5 rad/s divided by
    their number."""
    speed_of_all: Positive = 5.0
    """Greatest speed of all joints added up [rad/s]."""
    speed_increment: Annotated[float, Field(gt=0, le=1)] = 0.5
    """What increase and decrease change, as a fraction of the greatest speed."""
    tolerance: Positive = 0.02
    """Distance of the tip from the goal that counts as reached [m]."""
    most_decisions: Annotated[int, Field(ge=1, le=1_000_000)] = 150
    """Decisions after which an episode is broken off."""

    def scenario_defaults(self, preset: str) -> Mapping[str, object]:
        """Return what learns best here: little regularisation, and little foresight.

        The ridge weighs against the squared errors of all joints that share weights, so that it
        grows with their number. A written value is the distance of the tip from the goal.
        """
        if preset == "hand-written":
            return {"learner": {"value": {"distance": -1.0}}}
        if preset == "fitted-q":
            return {"learner": {"discount": DISCOUNT}}
        sharing = {"default": self.joints, "own-value": 1}
        if preset not in sharing:
            return {}
        return {"learner": {"ridge": RIDGE * sharing[preset], "discount": DISCOUNT}}

    @property
    def task_size(self) -> float:
        """Length of the arm [m], whatever the number of joints."""
        return 1.0

    @property
    def period(self) -> float:
        """Seconds for which a decision is held."""
        return PERIOD

    @property
    def top_speed(self) -> float:
        """Greatest speed of a joint [rad/s]: the more joints, the slower each.

        >>> KinematicChainSettings(joints=4).top_speed, KinematicChainSettings(joints=50).top_speed
        (0.6, 0.1)
        """
        return min(self.speed, self.speed_of_all / self.joints)
