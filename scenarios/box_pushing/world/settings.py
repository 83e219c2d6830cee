"""Settings of the reward, of robots, boxes, sensors and failures."""

import re
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Union

import numpy as np
from pydantic import BeforeValidator, Field

from ....core.numerics import FloatArray
from ....core.plugins.settings import Names, NonNegative, Positive, Settings
from ....core.plugins.sources import active
from ...faults.settings import DISCRIMINATOR, FailureSettings, build_kinds
from .infrared import Response, readings_at

GRAVITY = 9.81
"""Standard acceleration of free fall [m/s2], rounded."""
CONTROL_PERIOD = 0.064
"""Time between commands to the wheels [s]; the basic time step of the e-puck in Webots."""

Quantity = Annotated[float, Field(ge=1e-9, le=1e9)]
"""In SI units; the physics engine computes in single precision."""
Coefficient = Annotated[float, Field(ge=0, le=1e6)]
"""Coefficient of friction."""
Periods = Annotated[int, Field(ge=1, le=10_000)]
"""Control periods: ten minutes at most."""


class RewardSettings(Settings):
    """Constants of the reward (Eq. 15-17); distances in meters, angles in radians."""

    of: Literal["team", "robot"] = "team"
    """Recipient of the reward. With ``team`` the conditions depend on the contact and the infrared
    readings of all robots, as in the paper, and all agents receive one reward. With ``robot`` they
    depend on one robot's, and the agents of each robot receive their own reward."""
    c1: NonNegative = 0.01
    """Weight of R1 (Eq. 16), the reward for the box being near the goal."""
    r1: NonNegative = 1.5
    """Decay of R1 per meter of the box's distance to the goal (Eq. 16)."""
    c2: NonNegative = 0.0007
    """Weight of R2 and R3 (Eq. 16), the reward for robots being near the box."""
    r2: NonNegative = 5.0
    """Decay per unit of infrared reading of a robot (Eq. 16, for any number of robots)."""
    c4: NonNegative = 0.0003
    """Penalty per radian of the box's orientation error (Eq. 16)."""
    least_approach: NonNegative = 0.001
    """Minimum decrease of the box's distance to the goal in a decision period that counts as
    approach (Condition 1) [m]. With 0, motion by rounding errors would be rewarded."""
    receding: float = 0.000001
    """Reward under Condition 2."""
    some_out_of_range: float = -0.0015
    """Reward under Condition 4."""
    all_out_of_range: float = -0.002
    """Reward under Condition 5."""
    pays_at_goal: bool = True
    """Whether reaching the goal pays c1, even if a robot has lost contact with the box. Otherwise
    Conditions 1 to 5 also determine the reward at the goal."""
    attraction_without_contact: bool = False
    """Whether R1 counts under Condition 3, as printed in the paper. Without R1, robots gain nothing
    by staying near the box without contact."""


class WheelFailure(FailureSettings):
    """Wheels that fail."""

    part: ClassVar[str] = "wheels"

    wheels: Names
    """Wheels by agent name or pattern: ``robot1.left``, ``robot1.*``, ``*.left``; one or a list."""


if TYPE_CHECKING:
    Failure = WheelFailure
else:
    Failure = Annotated[Union[*build_kinds(WheelFailure).values()], DISCRIMINATOR]
"""Any failure's settings, distinguished by `kind`."""


def read_points(value: object) -> object:
    """Return the points ``((x, y), ...)`` [m] of a CSV file if the value is its path.

    The path is relative to the spec. The first line may name the columns.

    Raises
    ------
    ValueError
        If the file cannot be read, or a line is not two numbers; one line with file and line.
    """
    if not isinstance(value, str):
        return value
    points = []
    for number, line in enumerate(active().text(value).splitlines(), 1):
        is_header = number == 1 and not re.search(r"(^|,)\s*[-+.\d]", line)
        if line.strip() and not is_header:
            try:
                x, y = map(float, line.split(","))
            except ValueError:
                problem = f"{line!r}, must be two numbers x,y in meters"
                raise ValueError(f"{value}:{number}: {problem}") from None
            points.append((x, y))
    return tuple(points)


Vertices = Annotated[
    tuple[tuple[float, float], ...], Field(min_length=3), BeforeValidator(read_points)
]


Label = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f\x7f]+$")]


class BoxSettings(Settings):
    """User-defined box: ``box = { vertices = [[0, 0], [0.2, 0], [0.2, 0.1]] }``."""

    name: Label | None = None
    """Name in labels; nothing else depends on it."""
    vertices: Vertices
    """Outline, counter-clockwise [m]: a list of points, or the path of a CSV file with columns x
    and y, relative to the spec. Concave outlines are allowed."""
    holes: tuple[Vertices, ...] = ()
    """Outlines of holes [m], as `vertices`."""
    center_of_mass: tuple[float, float] | None = None
    """Center of mass in the coordinates of the vertices [m]; none: that of a uniform box. Mass and
    ground friction are spread around it as in a uniform box around its center."""
    mass: Quantity = 0.4
    """Mass of the box [kg]."""
    friction: Coefficient = 0.2
    """Coefficient of friction with the ground."""
    contact_friction: Coefficient = 0.3
    """Coefficient of friction with robots."""
    grows: bool | Literal["width"] = False
    """Whether the box grows with the number of robots, as the built-in boxes do, or along its
    ``width`` only, the side behind which robots start."""


class WheelSettings(Settings):
    """A wheel of a robot: its name, unique in its robot, and where it stands in the body frame."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Name of the wheel; its agent is called ``robot1.NAME``."""
    x: float
    """Position of the wheel ahead of the center [m]."""
    y: float
    """Position of the wheel to the left of the center [m]."""


class RobotSettings(Settings):
    """A robot. Defaults are those of the e-Puck."""

    name: Label | None = None
    """Name in labels; nothing else depends on it."""
    wheels: Annotated[tuple[WheelSettings, ...], Field(min_length=1, max_length=6)]
    """Wheels, one agent each; at most six, because predictions enumerate their joint actions."""
    radius: Annotated[float, Field(ge=0.001, le=10)] = 0.037
    """Radius of the round body [m]."""
    mass: Quantity = 0.15
    """Mass of the robot [kg], spread evenly over the disc and resting evenly on the wheels."""
    max_speed: Quantity = 0.13
    """Maximum wheel speed [m/s], over which the membership functions of wheel speeds spread."""
    stiffness: Quantity = 6.5
    """Stiffness of one wheel's servo [N per m/s]."""
    lateral_stiffness: Quantity = 20.0
    """Stiffness of one wheel's grip sideways [N per m/s]."""
    traction: Quantity = 0.8
    """Coefficient of friction between wheels and ground."""
    sensors: tuple[float, ...] | None = None
    """Directions of the infrared sensors [rad]; none: those of the e-Puck."""

    @property
    def wheel_names(self) -> tuple[str, ...]:
        """Names of the wheels in agent order."""
        return tuple(wheel.name for wheel in self.wheels)

    @property
    def inertia(self) -> float:
        """Moment of inertia about the center [kg m2], that of a disc."""
        return self.mass * self.radius**2 / 2

    @property
    def wheel_limit(self) -> float:
        """Greatest force between one wheel and the ground [N]."""
        return self.traction * self.mass * GRAVITY / len(self.wheels)


class InfraredSettings(Settings):
    """Response of the infrared sensors of all robots; the default is the e-Puck's.

    Examples
    --------
    >>> InfraredSettings().reading(np.array([0.0, 0.015, 0.07])).round(3).tolist()
    [1.0, 0.368, 0.0]
    """

    reach: Positive = 0.06
    """Distance beyond which the sensors read 0 [m]. Those of the e-Puck reach about 6 cm."""
    decay: Positive = 0.015
    """Distance over which readings, exp(-distance / decay) within reach, fall to 1/e [m]."""
    noise: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Standard deviation of a normal error, as a fraction of the reading (as in lookup tables of
    Webots); drawn independently for every sensor and decision; the result is clipped to [0, 1]."""

    @property
    def response(self) -> Response:
        """Constants of the response, for kernels."""
        return self.reach, self.decay

    def reading(self, distance: FloatArray) -> FloatArray:
        """Return the readings at distances [m] straight ahead; negative distances touch."""
        readings: FloatArray = readings_at(np.ravel(distance), self.response)
        return readings.reshape(np.shape(distance))

    def noisy(self, readings: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return readings with their error; without noise nothing is drawn."""
        if not self.noise:
            return readings
        return np.clip(readings * (1.0 + self.noise * rng.standard_normal(readings.shape)), 0, 1)


def label(thing: str | Settings) -> str:
    """Return the name of a thing, or what it consists of, as text that can be read back."""
    return thing if isinstance(thing, str) else thing.model_dump_json()
