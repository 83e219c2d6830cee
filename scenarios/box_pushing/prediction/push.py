"""Quasi-static pushing: poses of robots and box after a decision period.

Robots are soft velocity servos: a robot with commanded twist v* that pushes with the wrench w moves
with v* - W w, where W is its compliance. The box rests on distributed Coulomb
friction, described by the limit surface (Goyal, Ruina & Papadopoulos 1991) taken as an ellipsoid:
under sliding its wrench is F D v / sqrt(v' D v) with D = diag(1, 1, rho^2), F the maximum
friction force and rho the mean distance of the friction from the center. At a contact the robot
does not enter the box, and sticks to it within the friction cone. The contact forces are found by
a few Gauss-Seidel sweeps, in which the friction is replaced by the viscous one that equals it at
the last sweep's velocity. Without compliance and contact friction the robots are rigid: the
kinematic push.

`LANES` joint actions are computed side by side: every quantity is a row of a record with one number
for each of them, and loops over a row have no branch, so that the compiler uses the vector
instructions of the processor. The reference in plain Python is in the tests, `push_oracle.py`.
"""

from __future__ import annotations

import numpy as np

from ....core.numerics import BoolArray, FloatArray, IntArray, njit
from ...angles import cos_sin, rotate
from ..world.geometry import LANES, NEAREST, ON_SURFACE_M, Records, block_of, nearest_points
from .models import LearnedPush, PushModel
from .poses import push_by_weights

SUBSTEPS = 4
SWEEPS = 4
CREEP = 0.002
"""Speed of the box [m/s] below which ground friction is taken as viscous."""
START_SPEED = 0.05
"""Speed of the box [m/s] from which the sweeps start."""
MARGIN = 0.01
"""Maximum motion of the box's surface towards a robot within a substep [m]."""
POSE = ("x", "y", "heading", "cos", "sin")

# In the frame of a contact, n is the direction into the box and t is to its left. All velocities
# and forces of a contact are those at the rim of the robot.
ROBOT = block_of(
    *POSE,
    *("ahead", "left", "turn"),  # commanded twist in the frame of the robot
    *("normal_x", "normal_y"),  # direction n in the world frame
    *("lever_n", "lever_t"),  # torque on the box per force along n and t
    *("yield_nn", "yield_nt", "yield_tt"),  # velocity of the robot per force
    *("want_n", "want_t"),  # velocity of the free robot, minus what closes the gap
    *("force_n", "force_t"),  # force on the box
    "active",  # 1 if the robot may touch the box within the substep, else 0
)
"""One robot."""
BOX = block_of(
    *POSE,
    *("speed_x", "speed_y", "turn_rate"),
    *("mobility", "spin"),  # velocity per force, turn rate per torque
    *("force_x", "force_y", "torque"),  # sum of all contacts
)
"""The box."""
Compliance = tuple[float, float, float, float, float, float]
"""Upper triangle of a compliance matrix."""
_EXACT = {"contract", "nsz"}
"""Floating-point liberties: fused multiply-add, and zeros without sign."""


@njit(cache=True)
def push(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Predict poses after `seconds` for ``m`` combinations of robot twists.

    Parameters
    ----------
    robots
        ``(M, 3)`` current poses.
    box
        ``(3,)`` current pose.
    twists
        ``(M, K, 3)`` possible commanded twists of each robot, in its frame [m/s, m/s, rad/s].
    choices
        ``(M, m)`` index of the twist of each robot.
    seconds
        Duration of the push [s].
    model
        Model of robots and box.

    Returns
    -------
    robots, box, gaps : FloatArray
        Robot poses ``(M, 3, m)``, box poses ``(3, m)`` and gaps ``(M, m)`` [m].
    """
    return _push(robots, box, twists, choices, seconds, model, model.learned)


@njit(cache=True)
def _push(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
    learned: LearnedPush | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Predict as `push`; the type of the last argument decides which branch is compiled."""
    if learned is not None:
        return push_by_weights(robots, box, twists, choices, seconds, model, learned)
    n, m = choices.shape
    out_robots, out_box, out_gaps = np.empty((n, 3, m)), np.empty((3, m)), np.empty((n, m))
    bodies, boxes, blocks = np.zeros(n, ROBOT), np.zeros(1, BOX), np.zeros(1, NEAREST)
    touching = np.empty(n, np.bool_)
    for first in range(0, m, LANES):
        one, near = boxes[0], blocks[0]
        used = min(LANES, m - first)
        _set_pose(one, box)
        for r in range(n):
            robot = bodies[r]
            _set_pose(robot, robots[r])
            for k in range(LANES):  # lanes without a combination repeat the last one
                choice = choices[r, first + min(k, used - 1)]
                robot.ahead[k] = twists[r, choice, 0]
                robot.left[k] = twists[r, choice, 1]
                robot.turn[k] = twists[r, choice, 2]
        for _ in range(SUBSTEPS):
            _substep(bodies, one, near, touching, seconds / SUBSTEPS, model)
        _orient(one)
        for r in range(n):
            robot = bodies[r]
            _locate(robot, one, near, model.shape.edges)
            for k in range(used):
                c = first + k
                out_gaps[r, c] = near.distance[k] - model.shape.radius - model.radii[r]
                out_robots[r, 0, c] = robot.x[k]
                out_robots[r, 1, c] = robot.y[k]
                out_robots[r, 2, c] = robot.heading[k]
        for k in range(used):
            c = first + k
            out_box[0, c], out_box[1, c], out_box[2, c] = one.x[k], one.y[k], one.heading[k]
    return out_robots, out_box, out_gaps


@njit(cache=True)
def _substep(
    robots: Records,
    box: np.record,
    near: np.record,
    touching: BoolArray,
    dt: float,
    model: PushModel,
) -> None:
    """Find the contact forces of all robots, and move robots and box for `dt` seconds."""
    rho2 = model.shape.friction_radius**2
    _orient(box)
    for k in range(LANES):
        box.force_x[k] = box.force_y[k] = box.torque[k] = 0.0
        box.speed_x[k] = box.speed_y[k] = box.turn_rate[k] = 0.0
        box.mobility[k] = START_SPEED / model.friction_force
        box.spin[k] = box.mobility[k] / rho2
    for r in range(len(robots)):
        _orient(robots[r])
        _locate(robots[r], box, near, model.shape.edges)
        touching[r] = _touch(robots[r], box, near, r, model, dt)
    if touching.any():
        for _ in range(SWEEPS):
            for r in range(len(robots)):
                if touching[r]:
                    _respond(robots[r], box, model.contact_friction)
            _slide(box, rho2, model.friction_force)
    for r in range(len(robots)):
        _move(robots[r], model.radii[r], _entries(model.compliance[r]), dt)
    for k in range(LANES):
        box.x[k] += box.speed_x[k] * dt
        box.y[k] += box.speed_y[k] * dt
        box.heading[k] += box.turn_rate[k] * dt


@njit(cache=True)
def _set_pose(body: np.record, pose: FloatArray) -> None:
    x, y, heading = pose[0], pose[1], pose[2]
    for k in range(LANES):
        body.x[k] = x
        body.y[k] = y
        body.heading[k] = heading


@njit(cache=True, fastmath=_EXACT)
def _orient(body: np.record) -> None:
    for k in range(LANES):
        body.cos[k], body.sin[k] = cos_sin(body.heading[k])


@njit(cache=True, fastmath=_EXACT)
def _locate(robot: np.record, box: np.record, near: np.record, edges: FloatArray) -> None:
    """Write the position of a robot in the frame of the box, and the nearest point of the box."""
    for k in range(LANES):
        dx, dy = robot.x[k] - box.x[k], robot.y[k] - box.y[k]
        near.x[k], near.y[k] = rotate(box.cos[k], -box.sin[k], dx, dy)
    nearest_points(edges, near)


@njit(cache=True, forceinline=True)
def _entries(compliance: FloatArray) -> Compliance:
    c = compliance
    return c[0, 0], c[0, 1], c[0, 2], c[1, 1], c[1, 2], c[2, 2]


@njit(cache=True, forceinline=True, fastmath=_EXACT)
def _yielded(c: Compliance, fx: float, fy: float, torque: float) -> tuple[float, float, float]:
    """Return the twist by which a robot yields to a wrench, both in its frame."""
    return (
        c[0] * fx + c[1] * fy + c[2] * torque,
        c[1] * fx + c[3] * fy + c[4] * torque,
        c[2] * fx + c[4] * fy + c[5] * torque,
    )


@njit(cache=True, fastmath=_EXACT)
def _touch(
    robot: np.record, box: np.record, near: np.record, r: int, model: PushModel, dt: float
) -> bool:
    """Write the contact rows of a located robot; return whether it may touch the box."""
    radius, box_radius = model.radii[r], model.shape.radius
    compliance = _entries(model.compliance[r])
    touching = 0
    for k in range(LANES):
        ahead, left, turn = robot.ahead[k], robot.left[k], robot.turn[k]
        far = abs(near.distance[k]) > ON_SURFACE_M
        scale = 1.0 / near.distance[k] if far else 0.0
        out_x, out_y = scale * (near.x[k] - near.near_x[k]), scale * (near.y[k] - near.near_y[k])
        at_x, at_y = near.near_x[k] + box_radius * out_x, near.near_y[k] + box_radius * out_y
        gap = near.distance[k] - box_radius - radius
        touches = gap <= 2.0 * dt * np.sqrt(ahead * ahead + left * left) + MARGIN
        touching += 1 if touches else 0
        robot.active[k] = 1.0 if touches else 0.0
        nx, ny = rotate(box.cos[k], box.sin[k], -out_x, -out_y)
        lever_x, lever_y = rotate(box.cos[k], box.sin[k], at_x, at_y)
        robot.normal_x[k], robot.normal_y[k] = nx, ny
        robot.lever_t[k], robot.lever_n[k] = rotate(nx, ny, lever_x, -lever_y)
        # Directions n and t in the frame of the robot; its rim moves along t as it turns.
        n0, n1 = rotate(robot.cos[k], -robot.sin[k], nx, ny)
        t0, t1 = -n1, n0
        yield_n = _yielded(compliance, n0, n1, 0.0)
        yield_t = _yielded(compliance, t0, t1, radius)
        robot.yield_nn[k] = n0 * yield_n[0] + n1 * yield_n[1]
        robot.yield_nt[k] = n0 * yield_t[0] + n1 * yield_t[1]
        robot.yield_tt[k] = t0 * yield_t[0] + t1 * yield_t[1] + radius * yield_t[2]
        robot.want_n[k] = n0 * ahead + n1 * left - gap / dt
        robot.want_t[k] = t0 * ahead + t1 * left + radius * turn
    return touching > 0


@njit(cache=True, fastmath=_EXACT)
def _respond(robot: np.record, box: np.record, friction: float) -> None:
    """Update the contact force of a robot, given the forces of the other robots."""
    for k in range(LANES):
        nx, ny = robot.normal_x[k], robot.normal_y[k]
        lever_n, lever_t = robot.lever_n[k], robot.lever_t[k]
        mobility, spin = box.mobility[k], box.spin[k]
        # The wrench of all others, and the velocity that it leaves to this robot.
        own_x, own_y = rotate(nx, ny, robot.force_n[k], robot.force_t[k])
        fx, fy = box.force_x[k] - own_x, box.force_y[k] - own_y
        torque = box.torque[k] - (robot.force_n[k] * lever_n + robot.force_t[k] * lever_t)
        along_n, along_t = rotate(nx, -ny, fx, fy)
        want_n = robot.want_n[k] - mobility * along_n - spin * torque * lever_n
        want_t = robot.want_t[k] - mobility * along_t - spin * torque * lever_t
        nn = robot.yield_nn[k] + mobility + spin * lever_n * lever_n
        nt = robot.yield_nt[k] + spin * lever_n * lever_t
        tt = robot.yield_tt[k] + mobility + spin * lever_t * lever_t
        # The force at which both bodies move alike: a contact that sticks.
        det = nn * tt - nt * nt
        scale = 1.0 / det if det > 1e-12 * nn * tt else 0.0
        force_n = (tt * want_n - nt * want_t) * scale
        force_t = (nn * want_t - nt * want_n) * scale
        # If it slips, the tangential force is that of the friction cone, against the slip.
        ratio = friction if force_t > 0.0 else -friction
        slips = abs(force_t) > friction * force_n
        slipping = want_n / (nn + ratio * nt)
        force_n = slipping if slips else force_n
        force_t = ratio * slipping if slips else force_t
        pushes = (force_n > 0.0) & (robot.active[k] > 0.0)
        force_n = force_n if pushes else 0.0
        force_t = force_t if pushes else 0.0
        robot.force_n[k], robot.force_t[k] = force_n, force_t
        own_x, own_y = rotate(nx, ny, force_n, force_t)
        box.force_x[k], box.force_y[k] = fx + own_x, fy + own_y
        box.torque[k] = torque + (force_n * lever_n + force_t * lever_t)


@njit(cache=True, fastmath=_EXACT)
def _slide(box: np.record, rho2: float, force: float) -> None:
    """Set the velocity of the box under the contact forces."""
    for k in range(LANES):
        ux, uy = box.mobility[k] * box.force_x[k], box.mobility[k] * box.force_y[k]
        turn_rate = box.mobility[k] * box.torque[k] / rho2
        speed = np.sqrt(ux * ux + uy * uy + rho2 * turn_rate * turn_rate)
        box.speed_x[k], box.speed_y[k], box.turn_rate[k] = ux, uy, turn_rate
        mobility = (speed if speed > CREEP else CREEP) / force
        box.mobility[k], box.spin[k] = mobility, mobility / rho2


@njit(cache=True, fastmath=_EXACT)
def _move(robot: np.record, radius: float, compliance: Compliance, dt: float) -> None:
    """Move a robot for one substep under its twist and its contact force, which then ends."""
    for k in range(LANES):
        cos, sin = robot.cos[k], robot.sin[k]
        force_t = robot.force_t[k]
        fx, fy = rotate(robot.normal_x[k], robot.normal_y[k], -robot.force_n[k], -force_t)
        along, across = rotate(cos, -sin, fx, fy)
        back, aside, twist = _yielded(compliance, along, across, -radius * force_t)
        turn = robot.turn[k] + twist
        # The heading halfway, to second order in the turn: chords of the arc, not tangents.
        half = 0.5 * turn * dt
        cos, sin = rotate(cos, sin, 1.0 - 0.5 * half * half, half)
        dx, dy = rotate(cos, sin, robot.ahead[k] + back, robot.left[k] + aside)
        robot.x[k] += dx * dt
        robot.y[k] += dy * dt
        robot.heading[k] += turn * dt
        robot.force_n[k] = robot.force_t[k] = 0.0
