"""Forces between wheels and ground, for all robots of a world at once.

Wheel w of a robot that moves with twist v pulls it with

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

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....core.numerics.arrays import FloatArray, IntArray
from ....core.numerics.compiling import njit
from .settings import RobotSettings


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
        Units of length per metre.
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
def wheel_wrenches(  # type: ignore[no-untyped-def]
    motion: FloatArray, speeds: FloatArray, dt: float, model, last: FloatArray, out: FloatArray
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
