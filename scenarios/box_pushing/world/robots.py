"""Robots on wheels, and the forces between wheels and ground.

A robot has a round body, wheels that all point ahead, and infrared sensors around it. Its frame has
its origin at the center of the body, x ahead, y to the left, angles counter-clockwise. A wheel is a
soft velocity servo on a sticky ground: where it touches the ground it pulls the body with
`stiffness` times the difference between its own speed and the body's forward speed there, and
resists sideways motion with `lateral_stiffness`; both together never exceed its traction limit (the
friction circle). A further robot is one table in ``robots.toml``; a spec may also describe one.

The forces between wheels and ground are those of all robots of a world at once. Wheel w of a robot
that moves with twist v pulls it with

    f = (k_w (u_w - v_ahead), -l v_sideways),  |f| <= limit,

v taken where the wheel stands. A wheel holds its speed within milliseconds, faster than a physics
step, so that forces from the present twist would oscillate. They are therefore taken at the twist
that they lead to by the end of the step,

    (M + dt K) v' = M v + dt (B u + c),

K and B u being the sums over wheels of the above, and cut to the traction limit afterwards. c is
the wrench of contacts in the last step: what changed the velocity besides the wheels. Without it a
servo under a steady load would yield the more the longer the step.

Units are those of the caller as long as they are consistent.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from itertools import product
from math import radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit
from ....core.plugins.models import tuples
from ....core.plugins.words import closest
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
    """Return the compliance of a pushed robot, below its traction limit.

    Returns
    -------
    FloatArray
        ``(3, 3)`` twist per wrench at its center, body frame [m/s, m/s, rad/s per N, N, N m].
    """
    return np.linalg.inv(resistance(robot))


def nominal_effect(robot: RobotSettings) -> FloatArray:
    """Return the effect of the wheel speeds on the twist of a free robot without failures.

    The twist at which the wheel forces balance. For two wheels on one axle it is the kinematics of
    a differential drive; a skid-steer turns as if its axle were longer, as its wheels scrub. (The
    traction limit, neglected here, lets a fast turning skid-steer scrub more easily.)

    Returns
    -------
    FloatArray
        ``(3, n_wheels + 1)``: body twist [m/s, m/s, rad/s] = effect @ [wheel speeds [m/s], 1].
    """
    drive = np.array([[robot.stiffness, 0.0, -robot.stiffness * w.y] for w in robot.wheels]).T
    return np.hstack([compliance(robot) @ drive, np.zeros((3, 1))])


_TABLES = tuples(tomllib.loads(Path(__file__).with_name("robots.toml").read_text(encoding="utf-8")))


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


def opposite_wheels(robot: RobotSettings) -> list[int]:
    """Return the index of the wheel opposite to each wheel, or its own if it is in the middle.

    Raises
    ------
    ValueError
        If a wheel has none; one line.
    """
    places = [(wheel.x, wheel.y) for wheel in robot.wheels]
    for name, (x, y) in zip(robot.wheel_names, places, strict=True):
        if (x, -y) not in places:
            raise ValueError(
                f"learner.mirrored: wheel {name!r} of robot {robot.name or 'own'!r} has no wheel "
                "opposite"
            )
    return [places.index((x, -y)) for x, y in places]


def _check(robot: RobotSettings) -> None:
    """Refuse a robot with equal wheel names, wheels outside its body, or too few wheels."""
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


class WheelModel(NamedTuple):
    """Robots on their wheels; ``M`` robots, ``n`` wheels in all."""

    first: IntArray
    """``(M + 1,)`` index of the first wheel of each robot, and n."""
    mass: FloatArray
    """``(M, 3)`` mass, mass, moment of inertia."""
    points: FloatArray
    """``(n, 2)`` where the wheels stand in the body frame."""
    ahead: FloatArray
    """``(n,)`` stiffness along the heading."""
    sideways: FloatArray
    """``(n,)`` stiffness across it."""
    limit: FloatArray
    """``(n,)`` greatest force."""
    implicit: FloatArray
    """``(M, 3, 3)`` inverse of M + dt K."""


def wheel_model(
    robots: Sequence[RobotSettings], dt: float, grip: FloatArray, length: float = 1.0
) -> WheelModel:
    """Return the wheel model of robots.

    Parameters
    ----------
    robots
        The robots.
    dt
        Physics step [s].
    grip
        ``(n,)`` multiplies the stiffness ahead of every wheel: 1 healthy, 0 free-wheeling.
    length
        Units of length per meter.
    """
    first = np.cumsum([0] + [len(robot.wheels) for robot in robots])
    wheels = [(robot, wheel) for robot in robots for wheel in robot.wheels]
    points = np.array([[wheel.x, wheel.y] for _, wheel in wheels]) * length
    ahead = np.array([robot.stiffness for robot, _ in wheels]) * grip
    sideways = np.array([robot.lateral_stiffness for robot, _ in wheels])
    limit = np.array([robot.wheel_limit for robot, _ in wheels]) * length
    mass = np.array([[robot.mass, robot.mass, robot.inertia * length**2] for robot in robots])
    implicit = np.empty((len(robots), 3, 3))
    for r in range(len(robots)):
        total = np.diag(mass[r])
        for w in range(first[r], first[r + 1]):
            jacobian = np.array([[1.0, 0.0, -points[w, 1]], [0.0, 1.0, points[w, 0]]])
            total += dt * jacobian.T @ np.diag([ahead[w], sideways[w]]) @ jacobian
        implicit[r] = np.linalg.inv(total)
    return WheelModel(first, mass, points, ahead, sideways, limit, implicit)


@njit(cache=True)
def wheel_wrenches(
    motion: FloatArray,
    speeds: FloatArray,
    dt: float,
    model: WheelModel,
    last: FloatArray,
    out: FloatArray,
) -> None:
    """Compute the wheels' wrenches on all robots for one physics step.

    Parameters
    ----------
    motion
        ``(M, 4)`` heading and twist (vx, vy, omega) in the world frame.
    speeds
        ``(n,)`` wheel speeds.
    dt
        Physics step.
    model
        `WheelModel`.
    last
        ``(M, 3)`` twist of the step before; overwritten with the present one.
    out
        ``(M, 3)`` wrench (fx, fy, torque) of the step before, world frame; overwritten.
    """
    for r in range(motion.shape[0]):
        mass, inertia = model.mass[r, 0], model.mass[r, 2]
        vx, vy, w = motion[r, 1], motion[r, 2], motion[r, 3]
        # What contacts did in the last step, from the change of velocity.
        lx = mass * (vx - last[r, 0]) - dt * out[r, 0]
        ly = mass * (vy - last[r, 1]) - dt * out[r, 1]
        lw = inertia * (w - last[r, 2]) - dt * out[r, 2]
        last[r, 0], last[r, 1], last[r, 2] = vx, vy, w
        cos, sin = np.cos(motion[r, 0]), np.sin(motion[r, 0])
        px, py = mass * vx + lx, mass * vy + ly
        p0, p1, p2 = cos * px + sin * py, cos * py - sin * px, inertia * w + lw
        for i in range(model.first[r], model.first[r + 1]):
            pull = dt * model.ahead[i] * speeds[i]
            p0 += pull
            p2 -= model.points[i, 1] * pull
        a = model.implicit[r]
        v0 = a[0, 0] * p0 + a[0, 1] * p1 + a[0, 2] * p2
        v1 = a[1, 0] * p0 + a[1, 1] * p1 + a[1, 2] * p2
        v2 = a[2, 0] * p0 + a[2, 1] * p1 + a[2, 2] * p2
        f0 = f1 = torque = 0.0
        for i in range(model.first[r], model.first[r + 1]):
            x, y = model.points[i, 0], model.points[i, 1]
            fx = model.ahead[i] * (speeds[i] - v0 + y * v2)
            fy = -model.sideways[i] * (v1 + x * v2)
            force = np.sqrt(fx * fx + fy * fy)
            if force > model.limit[i]:
                fx *= model.limit[i] / force
                fy *= model.limit[i] / force
            f0 += fx
            f1 += fy
            torque += x * fy - y * fx
        out[r, 0], out[r, 1], out[r, 2] = cos * f0 - sin * f1, sin * f0 + cos * f1, torque


def sensor_directions(robots: Sequence[RobotSettings]) -> FloatArray:
    """Return the directions ``(M, S)`` of the robots' sensors [rad].

    Raises
    ------
    ValueError
        If robots have different numbers of sensors.
    """
    sensors = [E_PUCK_SENSORS if robot.sensors is None else robot.sensors for robot in robots]
    counts = {len(directions) for directions in sensors}
    if len(counts) != 1:
        raise ValueError(f"robots: {sorted(counts)} sensors, must be the same number on each")
    return np.array(sensors)


def side_actions(robot: RobotSettings, n_actions: int) -> IntArray:
    """Return the combinations ``(k, w)`` of actions to try: wheels of one side act alike."""
    sides = [int(np.sign(wheel.y)) for wheel in robot.wheels]
    groups = sorted(set(sides))
    rows = product(range(n_actions), repeat=len(groups))
    return np.array([[row[groups.index(side)] for side in sides] for row in rows])
