"""Quasi-static pushing: poses of robots and box after a decision period.

Robots are soft velocity servos: a robot with commanded twist v* that pushes with the wrench w moves
with v* - W w, where W is its compliance. The box rests on distributed Coulomb
friction, described by the limit surface (Goyal, Ruina & Papadopoulos 1991) taken as an ellipsoid:
under sliding its wrench is F D v / sqrt(v' D v) with D = diag(1, 1, rho^2), F the greatest
friction force and rho the mean distance of the friction from the centre. At a contact the robot
does not enter the box, and sticks to it within the friction cone. The contact forces are found by
a few Gauss-Seidel sweeps, in which the friction is replaced by the viscous one that equals it at
the last sweep's velocity. Without compliance and contact friction the robots are rigid: the
kinematic push.

With all forces multiplied by one factor, so that servos, grip and ground friction are as many times
as strong, every body moves as before. Not the three forces can be found out by moving, only two
ratios of them, and the friction at the contact (`CONSTANTS`). They are factors of what was believed
at first, in logarithms.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from ....core.numerics import BoolArray, FloatArray, IntArray, njit
from ..world.geometry import LANES, SIDE, SQUARE
from ..world.robots import resistance
from ..world.settings import RobotSettings
from . import push_lanes as lanes
from .push_lanes import BODY_SIZE, BOX_SIZE

SUBSTEPS = 4
SWEEPS = 4


class PushModel(NamedTuple):
    """Model of ``M`` robots and a box."""

    edges: FloatArray
    """Edges of the box, see `box_pushing.world.geometry.Outline`."""
    rounding: float
    """Margin around these edges [m]."""
    radii: FloatArray
    """``(M,)`` robot radii [m]."""
    compliance: FloatArray
    """``(M, 3, 3)`` twist per wrench in the robot frame [m/s, rad/s per N, Nm]; zero: rigid."""
    friction_force: float
    """Greatest ground friction of the box, F [N]."""
    friction_radius: float
    """rho [m]."""
    contact_friction: float
    """Coefficient of friction between robot and box."""


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
    n, m = choices.shape
    out_robots, out_box, out_gaps = np.empty((n, 3, m)), np.empty((3, m)), np.empty((n, m))
    dt = seconds / SUBSTEPS
    bodies, shared, near = np.zeros((n, BODY_SIZE)), np.zeros((1, BOX_SIZE)), np.empty(n, np.bool_)
    nearest = shared[0, lanes.NEAREST :]
    for first in range(0, m, LANES):
        used = min(LANES, m - first)
        for j in range(3):
            for k in range(LANES):
                shared[0, j * LANES + k] = box[j]
        for r in range(n):
            for k in range(LANES):  # lanes without a combination repeat the last one
                choice = choices[r, first + min(k, used - 1)]
                for j in range(3):
                    bodies[r, j * LANES + k] = robots[r, j]
                    bodies[r, lanes.AHEAD + j * LANES + k] = twists[r, choice, j]
        for _ in range(SUBSTEPS):
            _substep(bodies, shared, near, dt, model)
        lanes.head(shared, 0)
        for r in range(n):
            lanes.locate(bodies, r, shared[0], nearest, model.edges)
            for k in range(used):
                gap = np.sqrt(nearest[SQUARE + k]) * nearest[SIDE + k]
                out_gaps[r, first + k] = gap - model.rounding - model.radii[r]
            for j in range(3):
                for k in range(used):
                    out_robots[r, j, first + k] = bodies[r, j * LANES + k]
        for j in range(3):
            for k in range(used):  # slices that are assigned take seconds to compile
                out_box[j, first + k] = shared[0, j * LANES + k]
    return out_robots, out_box, out_gaps


@njit(cache=True)
def _substep(
    bodies: FloatArray, shared: FloatArray, near: BoolArray, dt: float, model: PushModel
) -> None:
    """Find the contact forces of all robots, and move robots and box for `dt` seconds."""
    rho2, box, nearest = model.friction_radius**2, shared[0], shared[0, lanes.NEAREST :]
    lanes.head(shared, 0)
    lanes.rest(box, rho2, model.friction_force)
    touching = False
    for r in range(len(bodies)):
        lanes.head(bodies, r)
        lanes.locate(bodies, r, box, nearest, model.edges)
        near[r] = lanes.touch(bodies, r, box, model.radii[r], model.rounding, model.compliance, dt)
        touching = touching or near[r]
    if touching:
        for _ in range(SWEEPS):
            lanes.answer(bodies, near, box, model.contact_friction)
            lanes.drag(box, rho2, model.friction_force)
    for r in range(len(bodies)):
        lanes.move(bodies, r, model.radii[r], model.compliance, dt)
    lanes.carry(box, dt)


CONSTANTS = ("load per stiffness", "load per grip", "contact friction")
"""The ground friction of the box over the stiffness of the wheels' servos, and over that of their
grip sideways; the coefficient of friction between robots and box."""


APART = 0.003
"""Gap between robots [m] below which they may push each other: the push predictor lets them pass
through one another, so that nothing is to be learned from it then."""


class PushBelief(NamedTuple):
    """Push models by constants."""

    model: PushModel
    """The model where all constants are 0: as believed at first."""
    ahead: FloatArray
    """``(M, 3, 3)`` what the servos add to the wrench per twist with which robots resist."""
    sideways: FloatArray
    """``(M, 3, 3)`` what the grip adds to it."""

    @classmethod
    def of(cls, model: PushModel, robots: Sequence[RobotSettings], stiffness: float) -> PushBelief:
        """Return the belief about robots, with an assumed factor on their stiffness."""
        parts = [
            stiffness * np.stack([resistance(robot, *part) for robot in robots])
            for part in ((1.0, 0.0), (0.0, 1.0))
        ]
        return cls(model, *parts)


@njit(cache=True)
def believing(belief: PushBelief, constants: FloatArray) -> PushModel:
    """Return the `PushModel` of constants ``(3,)``."""
    model, factors = belief.model, np.exp(constants)
    compliance = np.empty_like(belief.ahead)
    for r in range(len(compliance)):
        resists = belief.ahead[r] / factors[0] + belief.sideways[r] / factors[1]
        inverse = np.linalg.inv(resists)
        for i in range(3):
            for j in range(3):
                compliance[r, i, j] = inverse[i, j]
    return PushModel(
        model.edges,
        model.rounding,
        model.radii,
        compliance,
        model.friction_force,
        model.friction_radius,
        model.contact_friction * factors[2],
    )


@njit(cache=True)
def outcomes(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    seconds: float,
    belief: PushBelief,
    constants: FloatArray,
) -> FloatArray:
    """Predict one push under several constants.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` present poses.
    twists
        ``(M, 3)`` twists that are requested of the robots.
    seconds
        How long the push lasts [s].
    belief
        `PushBelief`.
    constants
        ``(k, 3)``.

    Returns
    -------
    FloatArray
        ``(k, M + 1, 3)`` mean twists of the box, and then of the robots, each in its own frame.
    """
    n = len(robots)
    moved = np.empty((len(constants), n + 1, 3))
    requested, choices = np.expand_dims(twists, 1), np.zeros((n, 1), np.int64)
    for p in range(len(constants)):
        model = believing(belief, constants[p])
        after, boxes, _ = push(robots, box, requested, choices, seconds, model)
        _twist(box, boxes[:, 0], seconds, moved[p, 0])
        for r in range(n):
            _twist(robots[r], after[r, :, 0], seconds, moved[p, r + 1])
    return moved


@njit(cache=True)
def _twist(before: FloatArray, after: FloatArray, seconds: float, out: FloatArray) -> None:
    """Write the constant twist ``(3,)`` in its own frame that leads from one pose to another."""
    half = 0.5 * (after[2] - before[2])
    # The chord of an arc is shorter than the arc by the sinc of half its angle.
    clipped = min(max(half, -0.5 * pi), 0.5 * pi)
    longer = clipped / np.sin(clipped) if abs(clipped) > 1e-9 else 1.0
    cos, sin = np.cos(before[2] + half), np.sin(before[2] + half)
    x, y = (after[0] - before[0]) * longer, (after[1] - before[1]) * longer
    out[0], out[1], out[2] = (cos * x + sin * y), (cos * y - sin * x), 2.0 * half
    out /= seconds


@njit(cache=True)
def mean_twists(before: FloatArray, after: FloatArray, seconds: float) -> FloatArray:
    """Return the constant twists ``(M, 3)``, own frame, between poses ``(M, 3)``.

    Headings count whole turns. For arcs beyond half a turn the speed is too low, because their
    chord no longer determines their length.
    """
    twists = np.empty(before.shape)
    for r in range(len(before)):
        _twist(before[r], after[r], seconds, twists[r])
    return twists


@njit(cache=True)
def least_gap(robots: FloatArray, radius: float) -> float:
    """Return the least gap [m] between robots ``(M, 3)`` of one radius; infinite for one robot."""
    least = np.inf
    for r in range(len(robots)):
        for other in range(r):
            dx, dy = robots[r, 0] - robots[other, 0], robots[r, 1] - robots[other, 1]
            least = min(least, np.hypot(dx, dy) - 2.0 * radius)
    return least
