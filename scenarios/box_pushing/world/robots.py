"""Wheeled robots: a round body, wheels that all point ahead, infrared sensors around it.

The body frame has its origin at the centre of the body, x ahead, y to the left, angles
counter-clockwise. A wheel is a soft velocity servo on a sticky ground: where it touches the ground
it pulls the body with `stiffness` times the difference between its own speed and the body's
forward speed there, and resists sideways motion with `lateral_stiffness`; both together never
exceed its traction limit (the friction circle), see `box_pushing.world.wheels`. A further
robot is one `RobotSpec` and one line in `ROBOTS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import isfinite, radians

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.plugins.messages import closest
from .settings import RobotSettings, WheelSettings

GRAVITY = 9.81
"""Standard acceleration of free fall [m/s2], rounded."""

E_PUCK_SENSORS = tuple(radians(a) for a in (-17.2, -45.9, -90.0, -151.5, 151.2, 90.0, 45.9, 17.2))
"""Directions of the e-puck's proximity sensors ps0 to ps7 [rad], clockwise from the front right.

From the E-puck model of Webots, which follows the real robot's board.
"""


@dataclass(frozen=True)
class RobotSpec:
    """A robot.

    Attributes
    ----------
    name
        The name under which specs know it.
    radius
        Of the round body [m].
    mass
        Of the whole robot, spread evenly over the disc and resting evenly on the wheels [kg].
    wheels
        The wheels, one agent each, in agent order.
    max_speed
        Greatest wheel speed [m/s].
    stiffness, lateral_stiffness
        Of one wheel's servo ahead and of its grip sideways [N per m/s].
    traction
        Coefficient of friction between wheel and ground.
    sensors
        Directions of the infrared sensors on the rim of the body [rad].

    Raises
    ------
    ValueError
        If a quantity is not positive and finite, there is no wheel, two wheels share a name, or a
        wheel stands outside the body.

    Examples
    --------
    >>> robot = ROBOTS["e-puck"]
    >>> robot.wheel_names
    ('left', 'right')
    >>> twist = nominal_effect(robot) @ [0.05, 0.05, 1.0]  # both wheels at 5 cm/s
    >>> [round(float(v), 9) for v in twist]
    [0.05, 0.0, 0.0]
    """

    name: str
    radius: float
    mass: float
    wheels: tuple[WheelSettings, ...]
    max_speed: float
    stiffness: float
    lateral_stiffness: float
    traction: float
    sensors: tuple[float, ...] = E_PUCK_SENSORS

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, int | float) and not (isfinite(value) and value > 0):
                raise ValueError(
                    f"robot {self.name!r}: {field.name} = {value}, must be positive and finite"
                )
        if not self.wheels or len(set(self.wheel_names)) != len(self.wheels):
            raise ValueError(
                f"robot {self.name!r}: wheels {list(self.wheel_names)}, "
                "must be at least one, of different names"
            )
        for wheel in self.wheels:
            if not np.hypot(wheel.x, wheel.y) <= self.radius:
                raise ValueError(
                    f"robot {self.name!r}: wheel {wheel.name!r} at ({wheel.x}, {wheel.y}) m, "
                    f"must lie within the body of radius {self.radius} m"
                )
        if not all(isfinite(angle) for angle in self.sensors):
            raise ValueError(f"robot {self.name!r}: sensors {self.sensors}, must be finite angles")
        if np.linalg.cond(resistance(self)) > 1e12:
            raise ValueError(
                f"robot {self.name!r}: its wheels cannot resist turning, "
                "there must be two at different places"
            )

    @property
    def wheel_names(self) -> tuple[str, ...]:
        """Names of the wheels in agent order."""
        return tuple(wheel.name for wheel in self.wheels)

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre [kg m2], that of a disc."""
        return self.mass * self.radius**2 / 2

    @property
    def wheel_limit(self) -> float:
        """Greatest force between one wheel and the ground [N]."""
        return self.traction * self.mass * GRAVITY / len(self.wheels)


def resistance(robot: RobotSpec, ahead: float = 1.0, sideways: float = 1.0) -> FloatArray:
    """Return the wrench per twist ``(3, 3)`` with which standing wheels resist a motion.

    The sum over wheels of ``J' diag(stiffness, lateral) J``, J the velocity of the wheel point,
    the stiffnesses multiplied by the factors `ahead` and `sideways`.
    """
    total = np.zeros((3, 3))
    stiffness = np.diag([ahead * robot.stiffness, sideways * robot.lateral_stiffness])
    for wheel in robot.wheels:
        jacobian = np.array([[1.0, 0.0, -wheel.y], [0.0, 1.0, wheel.x]])
        total += jacobian.T @ stiffness @ jacobian
    return total


def compliance(robot: RobotSpec) -> FloatArray:
    """Return by how much a pushed robot yields, below its traction limit.

    Returns
    -------
    FloatArray
        ``(3, 3)`` twist per wrench at its centre, body frame [m/s, m/s, rad/s per N, N, N m].
    """
    return np.linalg.inv(resistance(robot))


def nominal_effect(robot: RobotSpec) -> FloatArray:
    """Return what the wheel speeds do to the motion of a free, healthy robot.

    The twist at which the wheel forces balance. For two wheels on one axle it is the kinematics of
    a differential drive; a skid-steer turns as if its axle were longer, as its wheels scrub. (The
    traction limit, neglected here, lets a fast turning skid-steer scrub more easily.)

    Returns
    -------
    FloatArray
        ``(3, n_wheels + 1)``: body twist [m/s, m/s, rad/s] = effect @ [wheel speeds [m/s], 1].
    """
    drive = np.array([[robot.stiffness, 0.0, -robot.stiffness * w.y] for w in robot.wheels]).T
    constant = np.zeros((3, 1))
    return np.hstack([compliance(robot) @ drive, constant])


_LEFT = 0.053 / 2  # half the axle
_RADIUS = 0.037
_MASS = 0.15
_SPEED = 0.13
# Two robots that share a box of 0.8 N ground friction slip 3 cm/s; one alone keeps half its speed.
_TOTAL_STIFFNESS = 13.0
_RUBBER = 0.8


Places = Mapping[str, tuple[float, float]]


def _wheels(places: Places) -> tuple[WheelSettings, ...]:
    return tuple(WheelSettings(name=name, x=x, y=y) for name, (x, y) in places.items())


def _skid_steer(name: str, places: Places) -> RobotSpec:
    """Return a robot of the e-puck's body and drive, shared by more wheels; not a real one."""
    stiffness = _TOTAL_STIFFNESS / len(places)
    # A wheel that turns about its contact grips alike in all directions.
    return RobotSpec(name, _RADIUS, _MASS, _wheels(places), _SPEED, stiffness, stiffness, _RUBBER)


ROBOTS: dict[str, RobotSpec] = {
    robot.name: robot
    for robot in (
        # Radius, axle, speed, mass and sensors: Mondada et al. 2009, The e-puck, a robot designed
        # for education in engineering.
        RobotSpec(
            "e-puck", _RADIUS, _MASS, _wheels({"left": (0.0, _LEFT), "right": (0.0, -_LEFT)}),
            _SPEED, _TOTAL_STIFFNESS / 2, 20.0, _RUBBER,
        ),
        _skid_steer(
            "three-wheel", {"left": (0.01, _LEFT), "right": (0.01, -_LEFT), "rear": (-0.02, 0.0)}
        ),
        _skid_steer(
            "four-wheel",
            {
                "front-left": (0.018, _LEFT), "front-right": (0.018, -_LEFT),
                "rear-left": (-0.018, _LEFT), "rear-right": (-0.018, -_LEFT),
            },
        ),
        _skid_steer(
            "six-wheel",
            {
                "front-left": (0.022, _LEFT), "front-right": (0.022, -_LEFT),
                "middle-left": (0.0, _LEFT), "middle-right": (0.0, -_LEFT),
                "rear-left": (-0.022, _LEFT), "rear-right": (-0.022, -_LEFT),
            },
        ),
    )
}  # fmt: skip
"""Robots by the name that specs use."""


def robot_for(robot: str | RobotSettings) -> RobotSpec:
    """Return the robot that a spec names or describes, or that `label` has written.

    Raises
    ------
    ValueError
        If no robot has that name, or there can be none as described; one line.

    Examples
    --------
    >>> wheels = ({"name": "a", "x": 0, "y": 0.02}, {"name": "b", "x": 0, "y": -0.02})
    >>> robot_for(RobotSettings(wheels=wheels)).wheel_names
    ('a', 'b')
    """
    if isinstance(robot, str) and robot.startswith("{"):
        robot = RobotSettings.model_validate_json(robot)
    if isinstance(robot, RobotSettings):
        described = robot.model_dump() | {
            "name": "own",
            "wheels": robot.wheels,
            "sensors": E_PUCK_SENSORS if robot.sensors is None else robot.sensors,
        }
        return RobotSpec(**described)
    if robot not in ROBOTS:
        raise ValueError(f"scenario.robot = {robot!r}: {closest(robot, ROBOTS)}")
    return ROBOTS[robot]
