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
from .push_lanes import BODY_SIZE, BOX_SIZE, FIXED, MARGIN

SUBSTEPS = 4
SWEEPS = 4
VECTOR = 8
"""Lanes are used by so many at a time."""
ASKED = (
    lanes.AHEAD,
    lanes.LEFT,
    lanes.TURN,
    lanes.WANT_N,
    lanes.WANT_T,
    lanes.FORCE_N,
    lanes.FORCE_T,
    lanes.ACTIVE,
)
"""The rows of a robot that hang on what it is asked for; there are no forces at first."""
ROUNDED = 1e-9
"""Bound on rounding errors of a gap or a displacement [m]."""


class PushModel(NamedTuple):
    """Model of ``M`` robots and a box."""

    edges: FloatArray
    """Edges of the box, see `box_pushing.world.geometry.Outline`."""
    rounding: float
    """Margin around these edges [m]."""
    reach: float
    """Distance from the centre of the box within which all of it lies [m]."""
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


class Contacts(NamedTuple):
    """Initial contacts, which do not depend on the combination of twists."""

    rows: FloatArray
    """``(M, FIXED)`` one number for each of the first rows of `push_lanes`."""
    gaps: FloatArray
    """``(M,)`` [m]."""
    asked: FloatArray
    """``(M, K, 9)`` the rows `ASKED` under every twist, and the greatest way in a substep [m]."""


@njit(cache=True)
def contacts_of(
    robots: FloatArray, box: FloatArray, twists: FloatArray, seconds: float, model: PushModel
) -> Contacts:
    """Return the contacts of robots ``(M, 3)``, each asked for twists ``(M, K, 3)``."""
    n, count = twists.shape[:2]
    rows, gaps, asked = np.empty((n, FIXED)), np.empty(n), np.empty((n, count, len(ASKED) + 1))
    bodies, shared = np.zeros((n, BODY_SIZE)), np.zeros((1, BOX_SIZE))
    box_rows, nearest, dt = shared[0], shared[0, lanes.NEAREST :], seconds / SUBSTEPS
    radii, compliance, rounding = model.radii, model.compliance, model.rounding
    for first in range(0, count, LANES):
        used = min(LANES, count - first)
        width = (used + VECTOR - 1) // VECTOR * VECTOR
        for j in range(3):
            for k in range(width):
                shared[0, j * LANES + k] = box[j]
        lanes.head(shared, 0, width)
        for r in range(n):
            for j in range(3):
                for k in range(width):
                    bodies[r, j * LANES + k] = robots[r, j]
                for k in range(used):
                    bodies[r, lanes.AHEAD + j * LANES + k] = twists[r, first + k, j]
            lanes.head(bodies, r, width)
            lanes.locate(bodies, r, box_rows, nearest, model.edges, width)
            lanes.touch(bodies, r, box_rows, radii[r], rounding, compliance, dt, width)
            for k in range(used):
                for j in range(len(ASKED)):
                    asked[r, first + k, j] = bodies[r, ASKED[j] + k]
                ahead, left, turn = twists[r, first + k]
                half = 0.5 * dt * turn  # makes chords longer, see `lanes.move`
                square = (1.0 + 0.25 * half**4) * (ahead * ahead + left * left)
                asked[r, first + k, len(ASKED)] = dt * np.sqrt(square)
            for j in range(FIXED):
                rows[r, j] = bodies[r, j * LANES]
            gaps[r] = np.sqrt(nearest[SQUARE]) * nearest[SIDE] - rounding - radii[r]
    return Contacts(rows, gaps, asked)


def push(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Predict poses after `seconds` for many combinations of robot twists.

    Parameters
    ----------
    robots
        ``(M, 3)`` present poses.
    box
        ``(3,)`` present pose.
    twists
        ``(M, K, 3)`` twists that each robot may be asked for, in its own frame [m/s, m/s, rad/s].
    choices
        ``(m, M)`` which of its twists each robot takes.
    seconds
        Decision period [s].
    model
        Model of robots and box.

    Returns
    -------
    tuple
        Robot poses ``(m, M, 3)``, box poses ``(m, 3)`` and gaps ``(m, M)`` [m].
    """
    by_robot = np.ascontiguousarray(choices.T)
    after, boxes, gaps = pushed(robots, box, twists, by_robot, seconds, model)
    return after.transpose(2, 0, 1), boxes.T, gaps.T


@njit(cache=True)
def pushed(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what `push` does with situations last: ``(M, 3, m)``, ``(3, m)``, ``(M, m)``.

    So are the choices, ``(M, m)``.
    """
    contacts = contacts_of(robots, box, twists, seconds, model)
    return pushed_on(contacts, box, choices, seconds, model)


@njit(cache=True)
def pushed_on(
    contacts: Contacts, box: FloatArray, choices: IntArray, seconds: float, model: PushModel
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what `pushed` does, by the contacts of the robots."""
    n, m = choices.shape
    out_robots, out_box, out_gaps = np.empty((n, 3, m)), np.empty((3, m)), np.empty((n, m))
    dt = seconds / SUBSTEPS
    bodies, shared = np.empty((n, BODY_SIZE)), np.zeros((1, BOX_SIZE))
    way, spare, near = np.empty(n), np.empty(n), np.empty(n, np.bool_)
    nearest = shared[0, lanes.NEAREST :]
    for first in range(0, m, LANES):
        used = min(LANES, m - first)
        # Whole vectors are faster than their ends: lanes beyond repeat the last one.
        width = (used + VECTOR - 1) // VECTOR * VECTOR
        for j in range(3):
            for k in range(width):
                shared[0, j * LANES + k] = box[j]
        for r in range(n):
            way[r] = _begin(bodies, r, contacts, choices, first, used, width)
            spare[r] = contacts.gaps[r] - 2.0 * way[r] - MARGIN - ROUNDED
        moved = 0.0
        for substep in range(SUBSTEPS):
            moved = _substep(bodies, shared, near, substep, way, spare, moved, dt, model, width)
        lanes.head(shared, 0, width)
        for r in range(n):
            lanes.move(bodies, r, model.radii[r], model.compliance, dt, width)
            lanes.locate(bodies, r, shared[0], nearest, model.edges, width)
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
def _begin(
    bodies: FloatArray,
    r: int,
    contacts: Contacts,
    choices: IntArray,
    first: int,
    used: int,
    width: int,
) -> float:
    """Let a robot stand as it does at first; return how far at most it moves in a substep."""
    rows, asked = contacts.rows, contacts.asked
    for j in range(FIXED):
        row = rows[r, j]
        for k in range(width):
            bodies[r, j * LANES + k] = row
    chosen, others = choices[r, first + used - 1], 0
    for k in range(used):
        others += 1 if choices[r, first + k] != chosen else 0
    mixed = used if others > 0 else 0
    for j in range(len(ASKED)):
        row = asked[r, chosen, j]
        for k in range(width):
            bodies[r, ASKED[j] + k] = row
        for k in range(mixed):
            bodies[r, ASKED[j] + k] = asked[r, choices[r, first + k], j]
    way = asked[r, chosen, len(ASKED)]
    for k in range(mixed):
        way = max(way, asked[r, choices[r, first + k], len(ASKED)])
    return way


@njit(cache=True)
def _substep(
    bodies: FloatArray,
    shared: FloatArray,
    near: BoolArray,
    substep: int,
    way: FloatArray,
    spare: FloatArray,
    moved: float,
    dt: float,
    model: PushModel,
    width: int,
) -> float:
    """Find the contacts of all robots, their forces, and move the box for `dt` seconds.

    The robots are moved when they are next looked at, which saves to go through them once more.
    Taken and returned is by how much the surface of the box may have `moved` in all.
    """
    rho2, box, nearest = model.friction_radius**2, shared[0], shared[0, lanes.NEAREST :]
    radii, compliance, rounding = model.radii, model.compliance, model.rounding
    lanes.head(shared, 0, width)
    lanes.rest(box, rho2, model.friction_force, width)
    touching = False
    for r in range(len(bodies)):
        if substep > 0:
            lanes.move(bodies, r, radii[r], compliance, dt, width)
            lanes.head(bodies, r, width)
        near[r] = spare[r] <= substep * way[r] + moved
        if near[r] and substep > 0:
            lanes.locate(bodies, r, box, nearest, model.edges, width)
            count = lanes.touch(bodies, r, box, radii[r], rounding, compliance, dt, width)
            near[r] = count > 0
        touching = touching or near[r]
    if touching:
        for _ in range(SWEEPS):
            lanes.answer(bodies, near, box, model.contact_friction, width)
            lanes.drag(box, rho2, model.friction_force, width)
    return moved + lanes.carry(box, model.reach, dt, width)


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
        model.reach,
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
        after, boxes, _ = pushed(robots, box, requested, choices, seconds, model)
        _twist(box, boxes[:, 0], seconds, moved[p, 0])
        for r in range(n):
            _twist(robots[r], after[r, :, 0], seconds, moved[p, r + 1])
    return moved


@njit(cache=True)
def _twist(before: FloatArray, after: FloatArray, seconds: float, out: FloatArray) -> None:
    """Write the constant twist between two poses, as `prediction.mean_twists` does.

    With that in its place `outcomes` takes 3.9 times as long. The last bits of the two differ (a
    sine here, a sinc there), and published rows of self-models hang on those of the other; a test
    compares them.
    """
    half = 0.5 * (after[2] - before[2])
    # The chord of an arc is shorter than the arc by the sinc of half its angle.
    clipped = min(max(half, -0.5 * pi), 0.5 * pi)
    longer = clipped / np.sin(clipped) if abs(clipped) > 1e-9 else 1.0
    cos, sin = np.cos(before[2] + half), np.sin(before[2] + half)
    x, y = (after[0] - before[0]) * longer, (after[1] - before[1]) * longer
    out[0], out[1], out[2] = (cos * x + sin * y), (cos * y - sin * x), 2.0 * half
    out /= seconds


@njit(cache=True)
def least_gap(robots: FloatArray, radius: float) -> float:
    """Return the least gap [m] between robots ``(M, 3)`` of one radius; infinite for one robot."""
    least = np.inf
    for r in range(len(robots)):
        for other in range(r):
            dx, dy = robots[r, 0] - robots[other, 0], robots[r, 1] - robots[other, 1]
            least = min(least, np.hypot(dx, dy) - 2.0 * radius)
    return least
