"""The settings of a scenario, as they stand in the ``[scenario]`` table of a spec."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ..core.config import NonNegative, Positive, Settings

Count = Annotated[int, Field(ge=1)]


class RewardSettings(Settings):
    """The constants of the reward (Eq. 15-17); distances in metres, angles in radians."""

    c1: NonNegative = 0.01
    r1: NonNegative = 1.5
    """Per metre of the box's distance to the goal."""
    c2: NonNegative = 0.0007
    r2: NonNegative = 5.0
    """Per unit of infrared reading of a robot (R2 and R3 of Eq. 16 for any number of robots)."""
    c4: NonNegative = 0.0003
    """Per radian of the box's orientation error."""
    least_approach: NonNegative = 0.001
    """By how much the box must have come nearer in a decision period for a negative Delta D [m];
    with 0 a box that creeps by rounding errors is paid as one that is pushed."""
    receding: float = 0.000001
    """Reward under Condition 2."""
    some_out_of_range: float = -0.0015
    """Reward under Condition 4."""
    all_out_of_range: float = -0.002
    """Reward under Condition 5."""
    attraction_without_contact: bool = False
    """Whether R1 counts under Condition 3 as printed; without it robots do not hover."""


class ScenarioSettings(Settings):
    """The box-pushing scenario (Section IX)."""

    kind: Literal["box-pushing"] = "box-pushing"
    robots: Annotated[int, Field(ge=1, le=64)] = 2
    """Number of robots."""
    robot: str = "e-puck"
    """Robot by name."""
    box: str = "square"
    """Box by name."""
    start: Literal["easy", "medium", "hard"] = "medium"
    """Start distribution."""
    state_space: Literal["paper", "relational"] = "relational"
    """Eq. 1, or the relational variables."""
    reward: RewardSettings = RewardSettings()
    hold: Count = 8
    """Control periods of 64 ms for which a decision is held."""
    lookahead: Count = 24
    """Control periods that predictions look ahead, the decision being held for all of them."""
    speed_increment: Annotated[float, Field(gt=0, le=1)] = 0.5
    """What increase and decrease change, as a fraction of the greatest wheel speed."""
    tolerance: Positive = 0.05
    """Distance of the box from the goal that counts as reached [m]."""
    arena: Positive = 1.5
    """Distance of the box from the goal [m] beyond which an episode is broken off."""
    orientation_tolerance: Positive | None = None
    """Orientation error that still counts as reached [rad]; none: any."""
