"""Learned pushing: poses of robots and box after some decisions, linear in depths of contact.

Every robot first moves as if nothing stood in its way. In the frame of the box, its *contact* then
has a depth d in the box, a normal n into it, a tangent t to the left of n, a position p on the
surface and a travel s of the rim along t, all per second. The twist of the box is linear in six
sums over robots::

    sum d (n, p x n / rho),   sum s (t, p x t / rho),   with |s| <= d

where rho is the friction radius of the outline. A robot is deflected by what the motion of the box
leaves of d and s, linearly in seven features that depend on the angle a of n in its own frame::

    d (cos a, sin a, cos 3a, sin 3a),   s (1, cos a, sin a)

Known are the outline, the radii and the kinematics; unknown are masses, friction and stiffness.
"""

from __future__ import annotations

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit
from ...angles import rotate
from ..world.geometry import NEAREST, ON_SURFACE_M, Records, gaps, locate
from .models import LearnedPush, PushModel
from .twists import Twist, mean_twists, move

TWIST_SIGNS = np.array([1.0, -1.0, -1.0])
"""Signs of speed ahead, speed to the left and turning rate in a mirror image."""
BOX_SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Signs of the features of the box in a mirror image."""
ROBOT_SIGNS = np.array([1.0, -1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
"""Signs of the features of a robot in a mirror image."""


@njit(cache=True)
def push_by_weights(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
    learned: LearnedPush,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Predict poses by learned weights; see `push` for arguments and results."""
    n, m = choices.shape
    out_robots, out_box, out_gaps = np.empty((n, 3, m)), np.empty((3, m)), np.empty((n, m))
    poses, commands, contacts = np.empty((n + 1, 3)), np.empty((n, 3)), np.empty((n, 8))
    blocks = np.zeros(1, NEAREST)
    rho = model.shape.friction_radius
    for c in range(m):
        poses[0] = box
        poses[1:] = robots
        for r in range(n):
            commands[r] = twists[r, choices[r, c]]
        for _ in range(round(seconds / learned.period)):
            _touch(poses, commands, learned.period, model, blocks, contacts)
            moved = _weighted(_sums(contacts), learned.box)
            move(poses[0], (moved[0], moved[1], moved[2] / rho), learned.period)
            for r in range(n):
                x, y, turn = _weighted(_features(contacts[r], moved), learned.robot)
                command = commands[r]
                twist = command[0] + x, command[1] + y, command[2] + turn / model.radii[r]
                move(poses[r + 1], twist, learned.period)
        out_box[:, c] = poses[0]
        out_robots[:, :, c] = poses[1:]
        out_gaps[:, c] = gaps(poses[1:], poses[0], model.shape, model.radii)
    return out_robots, out_box, out_gaps


def samples_of(
    before: FloatArray, after: FloatArray, commands: FloatArray, seconds: float, model: PushModel
) -> list[tuple[FloatArray, FloatArray]]:
    """Return features and targets of both regressions for one decision and its mirror image.

    Parameters
    ----------
    before, after
        ``(M + 1, 3)`` poses before and after the decision, the box first.
    commands
        ``(M, 3)`` commanded twists of the robots.
    seconds
        Duration of the decision [s].
    model
        Its outline and radii are used.

    Returns
    -------
    list of tuple of FloatArray
        Sums ``(2, 6)`` and the twist ``(2, 3)`` of the box; features ``(2 M, 7)`` and deflections
        ``(2 M, 3)`` of the robots [m/s].
    """
    contacts = np.empty((len(commands), 8))
    _touch(before, commands, seconds, model, np.zeros(1, NEAREST), contacts)
    twists = mean_twists(before, after, seconds)
    twists[0, 2] *= model.shape.friction_radius
    deflections = twists[1:] - commands
    deflections[:, 2] *= model.radii
    sums = np.array([_sums(contacts)])
    features = np.array([_features(contact, tuple(twists[0])) for contact in contacts])
    box = _with_mirror(sums, BOX_SIGNS), _with_mirror(twists[:1], TWIST_SIGNS)
    return [
        box,
        (_with_mirror(features, ROBOT_SIGNS), _with_mirror(deflections, TWIST_SIGNS)),
    ]


def _with_mirror(rows: FloatArray, signs: FloatArray) -> FloatArray:
    return np.vstack([rows, rows * signs])


@njit(cache=True)
def _touch(
    poses: FloatArray,
    commands: FloatArray,
    seconds: float,
    model: PushModel,
    blocks: Records,
    contacts: FloatArray,
) -> None:
    """Write the contacts ``(M, 8)``: d, s, n, the levers of n and t over rho, cos a, sin a."""
    shape = model.shape
    box, near, free = poses[0], blocks[0], np.empty(3)
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(len(commands)):
        pose, twist, radius = poses[r + 1], commands[r], model.radii[r]
        free[:] = pose
        move(free, (twist[0], twist[1], twist[2]), seconds)
        x, y = rotate(cos, -sin, free[0] - box[0], free[1] - box[1])
        locate(x, y, shape.edges, near)
        depth = radius + shape.radius - near.distance[0]
        if depth <= 0.0:
            contacts[r] = 0.0
            continue
        scale = 1.0 / near.distance[0] if abs(near.distance[0]) > ON_SURFACE_M else 0.0
        nx, ny = scale * (near.near_x[0] - near.x[0]), scale * (near.near_y[0] - near.y[0])
        at_x, at_y = near.near_x[0] - shape.radius * nx, near.near_y[0] - shape.radius * ny
        way_x, way_y = rotate(cos, -sin, free[0] - pose[0], free[1] - pose[1])
        middle = 0.5 * (pose[2] + free[2]) - box[2]
        contacts[r, 0] = depth / seconds
        contacts[r, 1] = (nx * way_y - ny * way_x) / seconds + radius * twist[2]
        contacts[r, 2], contacts[r, 3] = nx, ny
        contacts[r, 4] = (at_x * ny - at_y * nx) / shape.friction_radius
        contacts[r, 5] = (at_x * nx + at_y * ny) / shape.friction_radius
        contacts[r, 6], contacts[r, 7] = rotate(np.cos(middle), -np.sin(middle), nx, ny)


@njit(cache=True)
def _sums(contacts: FloatArray) -> tuple[float, float, float, float, float, float]:
    """Return the features of the box."""
    dx = dy = d_turn = sx = sy = s_turn = 0.0
    for r in range(len(contacts)):
        contact = contacts[r]
        d = contact[0]
        s = min(max(contact[1], -d), d)
        dx += d * contact[2]
        dy += d * contact[3]
        d_turn += d * contact[4]
        sx -= s * contact[3]
        sy += s * contact[2]
        s_turn += s * contact[5]
    return dx, dy, d_turn, sx, sy, s_turn


@njit(cache=True)
def _features(
    contact: FloatArray, moved: Twist
) -> tuple[float, float, float, float, float, float, float]:
    """Return the features of a robot, given the twist of the box [m/s, times rho if turning]."""
    nx, ny, cos, sin = contact[2], contact[3], contact[6], contact[7]
    left = contact[0] - nx * moved[0] - ny * moved[1] - contact[4] * moved[2]
    slid = contact[1] + ny * moved[0] - nx * moved[1] - contact[5] * moved[2]
    d = max(left, 0.0)
    s = min(max(slid, -d), d)
    cos3, sin3 = cos * (4.0 * cos * cos - 3.0), sin * (3.0 - 4.0 * sin * sin)
    return d * cos, d * sin, d * cos3, d * sin3, s, s * cos, s * sin


@njit(cache=True)
def _weighted(features: tuple[float, ...], weights: FloatArray) -> Twist:
    """Return features times weights."""
    x = y = turn = 0.0
    for i in range(len(features)):
        x += features[i] * weights[i, 0]
        y += features[i] * weights[i, 1]
        turn += features[i] * weights[i, 2]
    return x, y, turn
