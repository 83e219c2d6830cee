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
"""Speed [m/s] below which ground friction is taken as viscous."""


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


@njit(cache=True)
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
    force_n, force_t = np.zeros(n), np.zeros(n)
    arms, gaps = np.empty((n, 6)), np.empty(n)
    inward = np.empty((n, 2))
    rho2 = model.friction_radius**2
    for c in range(m):
        now = robots.copy()
        bx, by, bpsi = box
        for _ in range(SUBSTEPS):
            active = _contacts(now, bx, by, bpsi, twists, choices[c], dt, model, gaps, inward, arms)
            ux, uy, uw = 0.0, 0.0, 0.0
            if active:
                ux, uy, uw = _solve(
                    now, twists, choices[c], dt, model, gaps, inward, arms, force_n, force_t, rho2
                )
            else:
                force_n[:] = 0.0
                force_t[:] = 0.0
            for r in range(n):
                vx, vy, w = _robot_velocity(
                    now[r, 2], twists[r, choices[c, r]], model.compliance[r], arms[r],
                    inward[r], force_n[r], force_t[r],
                )  # fmt: skip
                now[r, 0] += vx * dt
                now[r, 1] += vy * dt
                now[r, 2] += w * dt
            bx += ux * dt
            by += uy * dt
            bpsi += uw * dt
        for r in range(n):
            out_robots[c, r] = now[r]
            out_gaps[c, r] = _gap(now[r, 0], now[r, 1], bx, by, bpsi, model, r, inward[r], arms[r])
        out_box[c, 0], out_box[c, 1], out_box[c, 2] = bx, by, bpsi
    return out_robots, out_box, out_gaps


@njit(cache=True)
def _gap(x, y, bx, by, bpsi, model, r, inward, arms):  # type: ignore[no-untyped-def]
    """Return the gap of robot r; write the inward normal and the contact arms (world frame)."""
    cos, sin = np.cos(bpsi), np.sin(bpsi)
    dx, dy = x - bx, y - by
    distance, nx, ny, px, py = surface(
        model.edges, model.rounding, cos * dx + sin * dy, cos * dy - sin * dx
    )
    wx, wy = cos * nx - sin * ny, sin * nx + cos * ny
    inward[0], inward[1] = -wx, -wy
    arms[0], arms[1] = -model.radii[r] * wx, -model.radii[r] * wy
    arms[2], arms[3] = cos * px - sin * py, sin * px + cos * py
    return distance - model.radii[r]


@njit(cache=True)
def _contacts(now, bx, by, bpsi, twists, choice, dt, model, gaps, inward, arms):  # type: ignore[no-untyped-def]
    """Find which robots may touch the box within the substep; return how many."""
    active = 0
    for r in range(len(now)):
        dx, dy = now[r, 0] - bx, now[r, 1] - by
        clearance = np.sqrt(dx * dx + dy * dy) - model.reach - model.radii[r]
        twist = twists[r, choice[r]]
        travel = dt * np.sqrt(twist[0] ** 2 + twist[1] ** 2)
        if clearance > travel:
            gaps[r] = np.inf
            continue
        gaps[r] = _gap(now[r, 0], now[r, 1], bx, by, bpsi, model, r, inward[r], arms[r])
        # A moving box may carry its surface towards a robot, hence the margin.
        if gaps[r] > 2.0 * travel + 0.01:
            gaps[r] = np.inf
        else:
            active += 1
    return active


@njit(cache=True)
def _robot_velocity(heading, twist, compliance, arms, inward, fn, ft):  # type: ignore[no-untyped-def]
    """Return the world velocity and yaw rate of a robot under its contact force."""
    cos, sin = np.cos(heading), np.sin(heading)
    vx, vy, w = twist[0], twist[1], twist[2]
    if fn > 0.0:
        fx = -(fn * inward[0] - ft * inward[1])
        fy = -(fn * inward[1] + ft * inward[0])
        torque = arms[0] * fy - arms[1] * fx
        bx, by = cos * fx + sin * fy, cos * fy - sin * fx
        vx += compliance[0, 0] * bx + compliance[0, 1] * by + compliance[0, 2] * torque
        vy += compliance[1, 0] * bx + compliance[1, 1] * by + compliance[1, 2] * torque
        w += compliance[2, 0] * bx + compliance[2, 1] * by + compliance[2, 2] * torque
    return cos * vx - sin * vy, sin * vx + cos * vy, w


@njit(cache=True)
def _solve(now, twists, choice, dt, model, gaps, inward, arms, force_n, force_t, rho2):  # type: ignore[no-untyped-def]
    """Find the contact forces; return the velocity of the box."""
    n = len(now)
    force_n[:] = 0.0
    force_t[:] = 0.0
    drag = model.friction_force / 0.05
    ux, uy, uw = 0.0, 0.0, 0.0
    for _ in range(SWEEPS):
        for r in range(n):
            if gaps[r] == np.inf:
                continue
            ix, iy = inward[r]
            tx, ty = -iy, ix
            # Box at the contact: normal and tangential velocity, and its mobility there.
            px, py = arms[r, 2], arms[r, 3]
            pn, pt = px * iy - py * ix, px * ty - py * tx
            wx, wy, w = _wrench(inward, arms, force_n, force_t)
            ux, uy, uw = wx / drag, wy / drag, w / (drag * rho2)
            box_n = ux * ix + uy * iy + uw * pn
            box_t = ux * tx + uy * ty + uw * pt
            bnn, btt = (1.0 + pn * pn / rho2) / drag, (1.0 + pt * pt / rho2) / drag
            bnt = pn * pt / rho2 / drag
            # Robot at the contact, likewise; its mobility comes from its compliance.
            cos, sin = np.cos(now[r, 2]), np.sin(now[r, 2])
            ax, ay = arms[r, 0], arms[r, 1]
            jn = (cos * ix + sin * iy, cos * iy - sin * ix, ax * iy - ay * ix)
            jt = (cos * tx + sin * ty, cos * ty - sin * tx, ax * ty - ay * tx)
            rnn, rnt, rtt = 0.0, 0.0, 0.0
            for a in range(3):
                for b in range(3):
                    k = model.compliance[r, a, b]
                    rnn += jn[a] * k * jn[b]
                    rnt += jn[a] * k * jt[b]
                    rtt += jt[a] * k * jt[b]
            twist = twists[r, choice[r]]
            want_n = jn[0] * twist[0] + jn[1] * twist[1] + jn[2] * twist[2]
            want_t = jt[0] * twist[0] + jt[1] * twist[1] + jt[2] * twist[2]
            fn, ft = force_n[r], force_t[r]
            res_n = want_n - rnn * fn - rnt * ft - box_n - gaps[r] / dt
            res_t = want_t - rnt * fn - rtt * ft - box_t
            gnn, gnt, gtt = rnn + bnn, rnt + bnt, rtt + btt
            # Solve for the force at which both residuals vanish: contact that sticks.
            goal_n, goal_t = res_n + gnn * fn + gnt * ft, res_t + gnt * fn + gtt * ft
            det = gnn * gtt - gnt * gnt
            new_n, new_t = 0.0, 0.0
            if det > 1e-12 * gnn * gtt:
                new_n = (gtt * goal_n - gnt * goal_t) / det
                new_t = (gnn * goal_t - gnt * goal_n) / det
            mu = model.contact_friction
            if abs(new_t) > mu * new_n:
                # It slips: the tangential force is the cone's, against the slip.
                mu = mu if new_t > 0.0 else -mu
                new_n = goal_n / (gnn + mu * gnt)
                new_t = mu * new_n
            if new_n <= 0.0:
                new_n, new_t = 0.0, 0.0
            force_n[r], force_t[r] = new_n, new_t
        wx, wy, w = _wrench(inward, arms, force_n, force_t)
        ux, uy, uw = wx / drag, wy / drag, w / (drag * rho2)
        drag = model.friction_force / max(CREEP, np.sqrt(ux * ux + uy * uy + rho2 * uw * uw))
    return ux, uy, uw


@njit(cache=True)
def _wrench(inward, arms, force_n, force_t):  # type: ignore[no-untyped-def]
    """Return the force and torque of all contacts on the box."""
    wx, wy, w = 0.0, 0.0, 0.0
    for r in range(len(force_n)):
        if force_n[r] > 0.0:
            fx = force_n[r] * inward[r, 0] - force_t[r] * inward[r, 1]
            fy = force_n[r] * inward[r, 1] + force_t[r] * inward[r, 0]
            wx += fx
            wy += fy
            w += arms[r, 2] * fy - arms[r, 3] * fx
    return wx, wy, w
