"""The arithmetic of the push, for `LANES` joint actions side by side.

Every quantity of a joint action is one row of a scratch array, the joint actions of a chunk stand
next to each other in it, and every loop runs over them without a branch: so that the compiler can
use the vector instructions of the processor. Rows of `body` belong to one robot, rows of `box` to
the box and to what is passed between functions. A loop over a row at a constant offset is what
compilers see through. Functions are told which robot, n, is meant: to hand over the rows of one
robot takes as long as the arithmetic of eight joint actions. The readable definition, some thousand
times slower, is the oracle of the tests, `tests/scenarios/box_pushing/push_oracle.py`.
"""

import numpy as np

from ....core.numerics import BoolArray, FloatArray, njit
from ..world.geometry import LANES, NEAREST_SIZE, nearest_points

CREEP = 0.002
"""Speed of the box [m/s] below which ground friction is taken as viscous."""
START_SPEED = 0.05
"""Speed of the box [m/s] from which the sweeps start."""
MARGIN = 0.01
"""Maximum motion of the box's surface towards a robot within a substep [m]."""

# Where the rows of a robot begin: pose and heading, the twist that it is asked for, and its
# contact. In the frame of the contact, n is into the box, t to its left.
(
    X, Y, PSI, COS, SIN,
    AHEAD, LEFT, TURN,
    NX, NY,  # the direction n, world frame
    LEVER_N, LEVER_T,  # torque on the box per force along n and t
    YIELD_NN, YIELD_NT, YIELD_TT,  # how the robot yields there to force
    WANT_N, WANT_T,  # velocity there of the robot if free, less what closes the gap
    FORCE_N, FORCE_T,  # on the box
    ACTIVE,  # 1 if the robot may touch the box within the substep, else 0
) = range(0, 20 * LANES, LANES)  # fmt: skip
BODY_SIZE = ACTIVE + LANES

# Those of the box: pose and heading as for a robot, velocity, how readily it moves, the wrench of
# all contacts on it.
(
    U_X, U_Y, U_W, MOBILITY, SPIN,  # the last one over the square of the friction radius
    FORCE_X, FORCE_Y, TORQUE,
    NEAREST,  # rows of `nearest_points`, of one robot at a time in the frame of the box
) = range(AHEAD, AHEAD + 9 * LANES, LANES)  # fmt: skip
LOCAL_X, LOCAL_Y, SQUARE, NEAR_X, NEAR_Y, SIDE, EDGE_X, EDGE_Y = range(
    NEAREST, NEAREST + NEAREST_SIZE, LANES
)
BOX_SIZE = NEAREST + NEAREST_SIZE

_EXACT = {"contract", "nsz"}
"""Floating-point liberties: fused multiply-add, and zeros without sign."""


@njit(cache=True, fastmath=_EXACT)
def head(bodies: FloatArray, n: int) -> None:
    """Write cosine and sine of a heading: to the last bit but one, for any sane angle.

    The angle is reduced to an eighth of a turn on either side of a quarter, in two steps for
    accuracy, and the polynomials there are those of Sun's fdlibm.
    """
    for k in range(LANES):
        x = bodies[n, PSI + k]
        quarters = np.floor(x * 0.6366197723675814 + 0.5)
        r = x - quarters * 1.57079632673412561417 - quarters * 6.07710050650619224932e-11
        z = r * r
        s = 1.58969099521155010221e-10
        s = -2.50507602534068634195e-08 + z * s
        s = 2.75573137070700676789e-06 + z * s
        s = -1.98412698298579493134e-04 + z * s
        s = 8.33333333332248946124e-03 + z * s
        s = -1.66666666666666324348e-01 + z * s
        s = r + r * z * s
        c = -1.13596475577881948265e-11
        c = 2.08757232129817482790e-09 + z * c
        c = -2.75573143513906633035e-07 + z * c
        c = 2.48015872894767294178e-05 + z * c
        c = -1.38888888888741095749e-03 + z * c
        c = 4.16666666666666019037e-02 + z * c
        c = 1.0 - 0.5 * z + z * z * c
        quarter = quarters - 4.0 * np.floor(0.25 * quarters)
        odd = quarter == 1.0 or quarter == 3.0
        sine, cosine = c if odd else s, s if odd else c
        bodies[n, SIN + k] = -sine if quarter >= 2.0 else sine
        bodies[n, COS + k] = -cosine if quarter == 1.0 or quarter == 2.0 else cosine


@njit(cache=True, fastmath=_EXACT)
def locate(
    bodies: FloatArray, n: int, box: FloatArray, rows: FloatArray, edges: FloatArray
) -> None:
    """Write where a robot is in the frame of the box, and the point of the box next to it.

    `rows` are those of `nearest_points`.
    """
    for k in range(LANES):
        dx, dy = bodies[n, X + k] - box[X + k], bodies[n, Y + k] - box[Y + k]
        cos, sin = box[COS + k], box[SIN + k]
        box[LOCAL_X + k] = cos * dx + sin * dy
        box[LOCAL_Y + k] = cos * dy - sin * dx
    nearest_points(edges, rows, LANES)


@njit(cache=True, fastmath=_EXACT)
def touch(
    bodies: FloatArray,
    n: int,
    box: FloatArray,
    radius: float,
    rounding: float,
    compliance: FloatArray,
    dt: float,
) -> bool:
    """Write the contact rows of a robot that is located; return whether it may touch the box."""
    c00, c01, c02 = compliance[n, 0, 0], compliance[n, 0, 1], compliance[n, 0, 2]
    c10, c11, c12 = compliance[n, 1, 0], compliance[n, 1, 1], compliance[n, 1, 2]
    c20, c21, c22 = compliance[n, 2, 0], compliance[n, 2, 1], compliance[n, 2, 2]
    touching = 0
    for k in range(LANES):
        ahead, left, turn = (
            bodies[n, AHEAD + k],
            bodies[n, LEFT + k],
            bodies[n, TURN + k],
        )
        qx, qy, side = box[NEAR_X + k], box[NEAR_Y + k], box[SIDE + k]
        off = np.sqrt(box[SQUARE + k])
        # Away from the surface the normal points from the nearest point, on it across the edge.
        apart = off > 1e-12
        scale = side / (off if apart else 1.0)
        mx = scale * (box[LOCAL_X + k] - qx) if apart else box[EDGE_Y + k]
        my = scale * (box[LOCAL_Y + k] - qy) if apart else -box[EDGE_X + k]
        px, py = qx + rounding * mx, qy + rounding * my
        gap = side * off - rounding - radius
        travel = dt * np.sqrt(ahead * ahead + left * left)
        touches = gap <= 2.0 * travel + MARGIN
        touching += 1 if touches else 0
        cos, sin = box[COS + k], box[SIN + k]
        ix, iy = sin * my - cos * mx, -sin * mx - cos * my
        wx, wy = cos * px - sin * py, sin * px + cos * py
        ch, sh = bodies[n, COS + k], bodies[n, SIN + k]
        n0, n1 = ch * ix + sh * iy, ch * iy - sh * ix
        t0, t1 = -n1, n0
        bodies[n, ACTIVE + k] = 1.0 if touches else 0.0
        bodies[n, NX + k], bodies[n, NY + k] = ix, iy
        bodies[n, LEVER_N + k] = wx * iy - wy * ix
        bodies[n, LEVER_T + k] = wx * ix + wy * iy
        # Compliance times t, with the radius as its arm.
        yt0 = c00 * t0 + c01 * t1 + c02 * radius
        yt1 = c10 * t0 + c11 * t1 + c12 * radius
        yt2 = c20 * t0 + c21 * t1 + c22 * radius
        bodies[n, YIELD_NN + k] = n0 * (c00 * n0 + c01 * n1) + n1 * (c10 * n0 + c11 * n1)
        bodies[n, YIELD_NT + k] = n0 * yt0 + n1 * yt1
        bodies[n, YIELD_TT + k] = t0 * yt0 + t1 * yt1 + radius * yt2
        bodies[n, WANT_N + k] = n0 * ahead + n1 * left - gap / dt
        bodies[n, WANT_T + k] = t0 * ahead + t1 * left + radius * turn
    return touching > 0


@njit(cache=True, fastmath=_EXACT)
def rest(box: FloatArray, rho2: float, force: float) -> None:
    """Begin the sweeps: no forces, and a box that moves as readily as at `START_SPEED`."""
    for k in range(LANES):
        box[U_X + k] = box[U_Y + k] = box[U_W + k] = 0.0
        box[FORCE_X + k] = box[FORCE_Y + k] = box[TORQUE + k] = 0.0
        mobility = START_SPEED / force
        box[MOBILITY + k], box[SPIN + k] = mobility, mobility / rho2


@njit(cache=True, fastmath=_EXACT)
def answer(bodies: FloatArray, near: BoolArray, box: FloatArray, friction: float) -> None:
    """Let each robot near the box find its contact force in turn, the others' given."""
    for n in range(len(bodies)):
        for k in range(LANES if near[n] else 0):
            ix, iy = bodies[n, NX + k], bodies[n, NY + k]
            pn, pt = bodies[n, LEVER_N + k], bodies[n, LEVER_T + k]
            before_n, before_t = bodies[n, FORCE_N + k], bodies[n, FORCE_T + k]
            mobility = box[MOBILITY + k]
            # The wrench on the box of all others.
            fx = box[FORCE_X + k] - (before_n * ix - before_t * iy)
            fy = box[FORCE_Y + k] - (before_n * iy + before_t * ix)
            torque = box[TORQUE + k] - (before_n * pn + before_t * pt)
            # What is left to give by this robot once the others' forces have acted.
            lever = box[SPIN + k]
            want_n = bodies[n, WANT_N + k] - mobility * (fx * ix + fy * iy) - lever * torque * pn
            want_t = bodies[n, WANT_T + k] - mobility * (fy * ix - fx * iy) - lever * torque * pt
            nn = bodies[n, YIELD_NN + k] + mobility + lever * pn * pn
            nt = bodies[n, YIELD_NT + k] + lever * pn * pt
            tt = bodies[n, YIELD_TT + k] + mobility + lever * pt * pt
            # The force at which both bodies move alike there: a contact that sticks.
            det = nn * tt - nt * nt
            scale = 1.0 / det if det > 1e-12 * nn * tt else 0.0
            force_n = (tt * want_n - nt * want_t) * scale
            force_t = (nn * want_t - nt * want_n) * scale
            # It slips: the tangential force is the friction cone's, against the slip.
            ratio = friction if force_t > 0.0 else -friction
            slips = abs(force_t) > friction * force_n
            slipping = want_n / (nn + ratio * nt)
            force_n = slipping if slips else force_n
            force_t = ratio * slipping if slips else force_t
            pushes = (force_n > 0.0) & (bodies[n, ACTIVE + k] > 0.0)
            force_n = force_n if pushes else 0.0
            force_t = force_t if pushes else 0.0
            bodies[n, FORCE_N + k], bodies[n, FORCE_T + k] = force_n, force_t
            box[FORCE_X + k] = fx + (force_n * ix - force_t * iy)
            box[FORCE_Y + k] = fy + (force_n * iy + force_t * ix)
            box[TORQUE + k] = torque + (force_n * pn + force_t * pt)


@njit(cache=True, fastmath=_EXACT)
def drag(box: FloatArray, rho2: float, force: float) -> None:
    """Let the box move as the contact forces have it."""
    for k in range(LANES):
        mobility = box[MOBILITY + k]
        ux, uy = mobility * box[FORCE_X + k], mobility * box[FORCE_Y + k]
        uw = mobility * box[TORQUE + k] / rho2
        speed = np.sqrt(ux * ux + uy * uy + rho2 * uw * uw)
        box[U_X + k], box[U_Y + k], box[U_W + k] = ux, uy, uw
        mobility = (speed if speed > CREEP else CREEP) / force
        box[MOBILITY + k], box[SPIN + k] = mobility, mobility / rho2


@njit(cache=True, fastmath=_EXACT)
def move(bodies: FloatArray, n: int, radius: float, compliance: FloatArray, dt: float) -> None:
    """Move a robot for one substep under its twist and its contact force, which then ends."""
    c00, c01, c02 = compliance[n, 0, 0], compliance[n, 0, 1], compliance[n, 0, 2]
    c10, c11, c12 = compliance[n, 1, 0], compliance[n, 1, 1], compliance[n, 1, 2]
    c20, c21, c22 = compliance[n, 2, 0], compliance[n, 2, 1], compliance[n, 2, 2]
    for k in range(LANES):
        cos, sin = bodies[n, COS + k], bodies[n, SIN + k]
        ahead, left = bodies[n, AHEAD + k], bodies[n, LEFT + k]
        turn = bodies[n, TURN + k]
        force_n, force_t = bodies[n, FORCE_N + k], bodies[n, FORCE_T + k]
        ix, iy = bodies[n, NX + k], bodies[n, NY + k]
        fx, fy = force_t * iy - force_n * ix, -force_n * iy - force_t * ix
        lx, ly = cos * fx + sin * fy, cos * fy - sin * fx
        torque = -radius * force_t
        ahead += c00 * lx + c01 * ly + c02 * torque
        left += c10 * lx + c11 * ly + c12 * torque
        turn += c20 * lx + c21 * ly + c22 * torque
        # The heading halfway, to second order in the turn: chords, not tangents, of the arc.
        half = 0.5 * turn * dt
        c = cos - half * sin - 0.5 * half * half * cos
        s = sin + half * cos - 0.5 * half * half * sin
        bodies[n, X + k] += (c * ahead - s * left) * dt
        bodies[n, Y + k] += (s * ahead + c * left) * dt
        bodies[n, PSI + k] += turn * dt
        bodies[n, FORCE_N + k] = bodies[n, FORCE_T + k] = 0.0


@njit(cache=True, fastmath=_EXACT)
def carry(box: FloatArray, dt: float) -> None:
    """Move the box for one substep."""
    for k in range(LANES):
        box[X + k] += box[U_X + k] * dt
        box[Y + k] += box[U_Y + k] * dt
        box[PSI + k] += box[U_W + k] * dt
