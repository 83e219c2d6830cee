"""Where robots and box will be after a decision period: quasi-static pushing.

Robots are soft velocity servos: a robot whose wheels ask for the twist v* and that pushes with the
wrench w moves with v* - W w, where W is its compliance. The box rests on distributed Coulomb
friction, described by the limit surface (Goyal, Ruina & Papadopoulos 1991) taken as an ellipsoid:
under sliding its wrench is F D v / sqrt(v' D v) with D = diag(1, 1, rho^2), F the greatest
friction force and rho the mean distance of the friction from the centre. At a contact the robot
does not enter the box, and sticks to it within the friction cone. The contact forces are found by
a few Gauss-Seidel sweeps, in which the friction is replaced by the viscous one that equals it at
the last sweep's velocity. Without compliance and contact friction the robots are rigid: the
kinematic push.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from ..core.arrays import FloatArray, IntArray
from .geometry import surface

SUBSTEPS = 4
SWEEPS = 4
CREEP = 0.002
"""Speed of the box [m/s] below which ground friction is taken as viscous."""
START_SPEED = 0.05
"""Speed of the box [m/s] from which the sweeps start."""
MARGIN = 0.01
"""How far [m] a moving box may carry its surface towards a robot within a substep."""


class PushModel(NamedTuple):
    """What the push predictor believes of robots and box; ``M`` robots.

    Attributes
    ----------
    edges, rounding
        Outline of the box, see `nested_agents.scenarios.geometry.Outline`.
    reach
        Distance from the centre of the box within which all of it lies [m].
    radii
        ``(M,)`` robot radii [m].
    compliance
        ``(M, 3, 3)`` twist per wrench in the robot frame [m/s, rad/s per N, Nm]; zero: rigid.
    friction_force
        Greatest ground friction of the box, F [N].
    friction_radius
        rho [m].
    contact_friction
        Coefficient of friction between robot and box.
    """

    edges: FloatArray
    rounding: float
    reach: float
    radii: FloatArray
    compliance: FloatArray
    friction_force: float
    friction_radius: float
    contact_friction: float


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def push(  # type: ignore[no-untyped-def]
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    choices: IntArray,
    seconds: float,
    model: PushModel,
):
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
        What is believed of robots and box.

    Returns
    -------
    tuple
        Robot poses ``(m, M, 3)``, box poses ``(m, 3)`` and gaps ``(m, M)`` [m].
    """
    m, n = choices.shape
    out_robots = np.empty((m, n, 3))
    out_box = np.empty((m, 3))
    out_gaps = np.empty((m, n))
    dt = seconds / SUBSTEPS
    contacts = np.zeros((n, N_FIELDS))
    now = np.empty((n, 3))
    for c in range(m):
        now[:] = robots
        bx, by, bpsi = box[0], box[1], box[2]
        for _ in range(SUBSTEPS):
            ux, uy, uw = 0.0, 0.0, 0.0
            if _find_contacts(now, bx, by, bpsi, twists, choices[c], dt, model, contacts):
                ux, uy, uw = _solve(contacts, dt, model)
            for r in range(n):
                _move(now[r], twists[r, choices[c, r]], contacts[r], model.compliance[r], dt)
            bx += ux * dt
            by += uy * dt
            bpsi += uw * dt
        cos, sin = np.cos(bpsi), np.sin(bpsi)
        for r in range(n):
            out_robots[c, r] = now[r]
            dx, dy = now[r, 0] - bx, now[r, 1] - by
            lx, ly = cos * dx + sin * dy, cos * dy - sin * dx
            near = surface(model.edges, model.rounding, lx, ly)
            out_gaps[c, r] = near[0] - model.radii[r]
        out_box[c, 0], out_box[c, 1], out_box[c, 2] = bx, by, bpsi
    return out_robots, out_box, out_gaps


# A contact as one row of numbers; in the frame of the contact, n is into the box, t to its left.
_NX, _NY = 0, 1  # the direction n, world frame
_LEVER_N, _LEVER_T = 2, 3  # torque on the box per force along n and t
_ARM_X, _ARM_Y = 4, 5  # from the robot's centre to the contact, world frame
_YIELD_NN, _YIELD_NT, _YIELD_TT = 6, 7, 8  # how the robot yields there to force
_WANT_N, _WANT_T = 9, 10  # velocity there of the robot if free, less what closes the gap
_FORCE_N, _FORCE_T = 11, 12  # on the box
_COS, _SIN = 13, 14  # heading of the robot
_ACTIVE = 15
N_FIELDS = 16


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _find_contacts(now, bx, by, bpsi, twists, choice, dt, model, contacts):  # type: ignore[no-untyped-def]
    """Fill the contact rows of the robots that may touch the box within the substep."""
    found = False
    cos, sin = np.cos(bpsi), np.sin(bpsi)
    for r in range(len(now)):
        row, twist = contacts[r], twists[r, choice[r]]
        ch, sh = np.cos(now[r, 2]), np.sin(now[r, 2])
        row[_COS], row[_SIN] = ch, sh
        row[_ACTIVE] = row[_FORCE_N] = row[_FORCE_T] = 0.0
        dx, dy = now[r, 0] - bx, now[r, 1] - by
        radius = model.radii[r]
        travel = dt * np.sqrt(twist[0] ** 2 + twist[1] ** 2)
        if np.sqrt(dx * dx + dy * dy) - model.reach - radius > 2.0 * travel + MARGIN:
            continue
        lx, ly = cos * dx + sin * dy, cos * dy - sin * dx
        distance, nx, ny, px, py = surface(model.edges, model.rounding, lx, ly)
        gap = distance - radius
        if gap > 2.0 * travel + MARGIN:
            continue
        found = True
        ix, iy = sin * ny - cos * nx, -sin * nx - cos * ny
        tx, ty = -iy, ix
        wx, wy = cos * px - sin * py, sin * px + cos * py
        ax, ay = radius * ix, radius * iy
        row[_ACTIVE] = 1.0
        row[_NX], row[_NY], row[_ARM_X], row[_ARM_Y] = ix, iy, ax, ay
        row[_LEVER_N], row[_LEVER_T] = wx * iy - wy * ix, wx * ty - wy * tx
        jn = (ch * ix + sh * iy, ch * iy - sh * ix, 0.0)
        jt = (ch * tx + sh * ty, ch * ty - sh * tx, radius)
        nn, nt, tt = 0.0, 0.0, 0.0
        for a in range(3):
            for b in range(3):
                k = model.compliance[r, a, b]
                nn += jn[a] * k * jn[b]
                nt += jn[a] * k * jt[b]
                tt += jt[a] * k * jt[b]
        row[_YIELD_NN], row[_YIELD_NT], row[_YIELD_TT] = nn, nt, tt
        row[_WANT_N] = jn[0] * twist[0] + jn[1] * twist[1] - gap / dt
        row[_WANT_T] = jt[0] * twist[0] + jt[1] * twist[1] + radius * twist[2]
    return found


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _solve(contacts, dt, model):  # type: ignore[no-untyped-def]
    """Find the contact forces; return the velocity of the box."""
    rho2 = model.friction_radius**2
    mobility = START_SPEED / model.friction_force
    ux, uy, uw = 0.0, 0.0, 0.0
    for _ in range(SWEEPS):
        for r in range(len(contacts)):
            row = contacts[r]
            if row[_ACTIVE] == 0.0:
                continue
            ix, iy, pn, pt = row[_NX], row[_NY], row[_LEVER_N], row[_LEVER_T]
            fx, fy, torque = _wrench(contacts, r)
            # What is left to give by this robot once the others' forces have acted.
            want_n = row[_WANT_N] - mobility * (fx * ix + fy * iy + torque * pn / rho2)
            want_t = row[_WANT_T] - mobility * (fy * ix - fx * iy + torque * pt / rho2)
            nn = row[_YIELD_NN] + mobility * (1.0 + pn * pn / rho2)
            nt = row[_YIELD_NT] + mobility * pn * pt / rho2
            tt = row[_YIELD_TT] + mobility * (1.0 + pt * pt / rho2)
            # The force at which both bodies move alike there: a contact that sticks.
            det = nn * tt - nt * nt
            force_n, force_t = 0.0, 0.0
            if det > 1e-12 * nn * tt:
                force_n = (tt * want_n - nt * want_t) / det
                force_t = (nn * want_t - nt * want_n) / det
            if abs(force_t) > model.contact_friction * force_n:
                # It slips: the tangential force is the friction cone's, against the slip.
                ratio = model.contact_friction if force_t > 0.0 else -model.contact_friction
                force_n = want_n / (nn + ratio * nt)
                force_t = ratio * force_n
            if force_n <= 0.0:
                force_n, force_t = 0.0, 0.0
            row[_FORCE_N], row[_FORCE_T] = force_n, force_t
        fx, fy, torque = _wrench(contacts, -1)
        ux, uy, uw = mobility * fx, mobility * fy, mobility * torque / rho2
        speed = np.sqrt(ux * ux + uy * uy + rho2 * uw * uw)
        mobility = max(CREEP, speed) / model.friction_force
    return ux, uy, uw


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _wrench(contacts, leave_out: int):  # type: ignore[no-untyped-def]
    """Return the force and torque on the box of all contacts but one."""
    fx, fy, torque = 0.0, 0.0, 0.0
    for r in range(len(contacts)):
        row = contacts[r]
        if r != leave_out and row[_FORCE_N] > 0.0:
            fx += row[_FORCE_N] * row[_NX] - row[_FORCE_T] * row[_NY]
            fy += row[_FORCE_N] * row[_NY] + row[_FORCE_T] * row[_NX]
            torque += row[_FORCE_N] * row[_LEVER_N] + row[_FORCE_T] * row[_LEVER_T]
    return fx, fy, torque


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _move(pose, twist, row, compliance, dt):  # type: ignore[no-untyped-def]
    """Move a robot for one substep under its twist and its contact force."""
    cos, sin = row[_COS], row[_SIN]
    ahead, left, turn = twist[0], twist[1], twist[2]
    if row[_FORCE_N] > 0.0:
        fx = row[_FORCE_T] * row[_NY] - row[_FORCE_N] * row[_NX]
        fy = -row[_FORCE_N] * row[_NY] - row[_FORCE_T] * row[_NX]
        torque = row[_ARM_X] * fy - row[_ARM_Y] * fx
        lx, ly = cos * fx + sin * fy, cos * fy - sin * fx
        ahead += compliance[0, 0] * lx + compliance[0, 1] * ly + compliance[0, 2] * torque
        left += compliance[1, 0] * lx + compliance[1, 1] * ly + compliance[1, 2] * torque
        turn += compliance[2, 0] * lx + compliance[2, 1] * ly + compliance[2, 2] * torque
    # The heading halfway, to second order in the turn: chords, not tangents, of the arc.
    half = 0.5 * turn * dt
    c, s = cos - half * sin - 0.5 * half * half * cos, sin + half * cos - 0.5 * half * half * sin
    pose[0] += (c * ahead - s * left) * dt
    pose[1] += (s * ahead + c * left) * dt
    pose[2] += turn * dt
