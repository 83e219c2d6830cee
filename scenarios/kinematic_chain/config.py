"""Settings of the kinematic chain."""

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
from ..faults.settings import DISCRIMINATOR, FailureSettings, build_kinds
from ..state_variables import names_of
from .variables import CHAIN_VARIABLES

PERIOD = 0.1
"""Decision period [s]."""
REACH = 1.0
"""Length of the arm [m]."""
RIDGE = 0.1
"""Best ridge of the regression, per joint that shares its weights."""
SIMPLE = ("bearing", "distance", "approach")
"""State variables that `kinematic_chain.responses` supports."""
DISCOUNT = 0.8
"""Best discount; a goal is about twenty decisions away."""


class ReachingRewardSettings(Settings):
    """Constants of the joint reward, similar to Eq. 15-17, with distances in meters.

    The reward for approaching is much smaller than that at the goal, because an arm that is
    rewarded for approaching alone learns to circle around the goal.
    """

    c1: NonNegative = 0.01
    """Reward at the goal."""
    c2: NonNegative = 0.003
    """Reward for approaching, multiplied by ``exp(-r2 distance)``."""
    r2: NonNegative = 1.5
    """Decay of the approach reward with the distance of the tip from the goal [1/m]."""
    least_approach: NonNegative = 0.001
    """Minimum decrease of the distance per decision for the approach reward [m]."""
    receding: float = -0.005
    """Reward if the tip does not approach the goal."""


class JointFailure(FailureSettings):
    """Failure of joints."""

    part: ClassVar[str] = "joints"

    joints: Names
    """Names or patterns of joints, such as ``joint2`` or ``joint*``."""


if TYPE_CHECKING:
    Failure = JointFailure
else:
    _KINDS = build_kinds(
        JointFailure, locked="seized", weak="weak", reversed="reversed", stuck="stuck"
    )
    Failure = Annotated[Union[*_KINDS.values()], DISCRIMINATOR]
"""Settings of a failure of any `kind`."""


class KinematicChainSettings(ScenarioSettings):
    """A planar arm of ``joints`` equal links, 1 m in total, with its base at the origin."""

    kind: Literal["kinematic-chain"] = "kinematic-chain"
    factory: ClassVar[str] = f"{__package__}.scenario:KinematicChain"
    joints: Annotated[int, Field(ge=2), team_size(1e-8)] = 4
    """Number of joints, one agent each. The maximum follows from estimated memory and time."""
    failures: tuple[Failure, ...] = ()
    """Failures of joints."""
    predictor: Literal["nominal", "informed"] = "nominal"
    """``nominal`` predictions assume that all joints work; ``informed`` ones include failures."""
    state_space: Annotated[tuple[str, ...], names_of(CHAIN_VARIABLES)] = SIMPLE
    """State variables in addition to the speed of the joint, by name; see
    `kinematic_chain.variables`."""
    reward: ReachingRewardSettings = ReachingRewardSettings()
    """Constants of the reward."""
    speed: Positive = 0.6
    """Maximum speed of a joint [rad/s]; in arms of many joints it is `speed_of_all` divided by
    their number."""
    speed_of_all: Positive = 5.0
    """Maximum sum of the speeds of all joints [rad/s]."""
    speed_increment: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Change of the commanded speed by one action, as a fraction of the maximum speed."""
    tolerance: Positive = 0.02
    """Distance of the tip from the goal at which the goal is reached [m]."""
    most_decisions: Annotated[int, Field(ge=1, le=1_000_000)] = 150
    """Maximum number of decisions of an episode."""

    def scenario_defaults(self, preset: str) -> Mapping[str, object]:
        """Return defaults of the learner: weak regularization and a low discount.

        The ridge grows with the number of joints that share weights, because it is compared with
        the sum of their squared errors. A hand-written value is the distance from the goal.
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
        """Length of the arm [m], for any number of joints."""
        return 1.0

    @property
    def period(self) -> float:
        """Decision period [s]."""
        return PERIOD

    @property
    def top_speed(self) -> float:
        """Maximum speed of a joint [rad/s], which decreases with the number of joints.

        >>> KinematicChainSettings(joints=4).top_speed, KinematicChainSettings(joints=50).top_speed
        (0.6, 0.1)
        """
        return min(self.speed, self.speed_of_all / self.joints)
