"""Wheeled robots: a round body, wheels that all point ahead, infrared sensors around it.

The body frame has its origin at the centre of the body, x ahead, y to the left, angles
counter-clockwise. A wheel is a soft velocity servo on a sticky ground: where it touches the ground
it pulls the body with `stiffness` times the difference between its own speed and the body's
forward speed there, and resists sideways motion with `lateral_stiffness`; both together never
exceed its traction limit (the friction circle), see `box_pushing.world.wheels`. A further
robot is one table in ``robots.toml``; a spec may also describe one.
"""

import tomllib
from math import radians
from pathlib import Path

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.plugins.messages import closest
from ....core.plugins.settings import tuples
from .settings import RobotSettings

E_PUCK_SENSORS = tuple(radians(a) for a in (-17.2, -45.9, -90.0, -151.5, 151.2, 90.0, 45.9, 17.2))
"""Directions of the e-puck's proximity sensors ps0 to ps7 [rad], clockwise from the front right.

From the E-puck model of Webots, which follows the real robot's board.
"""


def resistance(robot: RobotSettings, ahead: float = 1.0, sideways: float = 1.0) -> FloatArray:
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


def compliance(robot: RobotSettings) -> FloatArray:
    """Return by how much a pushed robot yields, below its traction limit.

    Returns
    -------
    FloatArray
        ``(3, 3)`` twist per wrench at its centre, body frame [m/s, m/s, rad/s per N, N, N m].
    """
    return np.linalg.inv(resistance(robot))


def nominal_effect(robot: RobotSettings) -> FloatArray:
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


_TABLES = tuples(tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")))

ROBOTS = {name: RobotSettings(name=name, **table) for name, table in _TABLES.items()}
"""Robots by the name that specs use."""


def robot_for(robot: str | RobotSettings) -> RobotSettings:
    """Return the robot that a spec names or describes, or that `label` has written.

    Raises
    ------
    ValueError
        If no robot has that name, or there can be none as described; one line.

    Examples
    --------
    >>> robot_for("e-puck").wheel_names
    ('left', 'right')
    """
    if isinstance(robot, str) and robot.startswith("{"):
        robot = RobotSettings.model_validate_json(robot)
    if isinstance(robot, RobotSettings):
        _check(robot)
        return robot
    if robot not in ROBOTS:
        raise ValueError(f"scenario.robot = {robot!r}: {closest(robot, ROBOTS)}")
    return ROBOTS[robot]


def _check(robot: RobotSettings) -> None:
    """Refuse a robot whose wheels share a name, stand outside its body, or cannot hold it."""
    name = f"robot {robot.name or 'own'!r}"
    if len(set(robot.wheel_names)) != len(robot.wheels):
        raise ValueError(f"{name}: wheels {list(robot.wheel_names)}, must be of different names")
    for wheel in robot.wheels:
        if not np.hypot(wheel.x, wheel.y) <= robot.radius:
            raise ValueError(
                f"{name}: wheel {wheel.name!r} at ({wheel.x}, {wheel.y}) m, "
                f"must lie within the body of radius {robot.radius} m"
            )
    if np.linalg.cond(resistance(robot)) > 1e12:
        raise ValueError(
            f"{name}: its wheels cannot resist turning, there must be two at different places"
        )
