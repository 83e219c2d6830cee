"""The relational variables of many predicted situations, compiled.

Situations stand side by side in flat scratch rows, as in `push_lanes`, and all loops over them are
free of branches. The NumPy functions of `relational` are the definition and the test oracle. Both
stand: for 256 situations of two robots the kernel takes a third of their time, for 64 of eight
robots a ninth, and its last bits are others, so that sensing, by which agents learn, keeps to the
functions.
"""

from collections.abc import Sequence
from math import pi
from typing import TypeAlias

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit
from ..world import geometry as rows
from ..world.geometry import LANES, ON_SURFACE, nearest_points
from .relational import ARRIVED, AWAY, CLOSE, KEPT, LEAST, STATE_VARIABLES, STILL, View

_EXACT = {"contract", "nsz"}

IN_ORDER = 64
"""So many robots are added up one by one for each of them, as published results were; of more, each
is taken off the sum of all."""

COMPILED = tuple(STATE_VARIABLES.built_in)
"""The built-in variables that are computed here, each in a row of scratch of its own."""
# Where these rows begin.
(
    GAP,
    BEARING,
    SIDE,
    OTHERS,
    PUSH,
    CROSS_TRACK,
    DISTANCE,
    APPROACH,
    TURN,
    BEND,
    FACE_BEARING,
    AWAY_OTHERS,
    CONTACT_PUSH,
    CONTACT_CROSS_TRACK,
    PATH,
    PATH_CROSS_TRACK,
) = range(0, len(COMPILED) * LANES, LANES)
# Rows of what several variables need; no column can name them.
_COURSE, _X, _Y, _WEIGHT, _WIDEST, _SECOND, _AWAY, _COS, _SIN, _NEAREST = range(
    len(COMPILED) * LANES, (len(COMPILED) + 10) * LANES, LANES
)
_SIZE = _NEAREST + rows.NEAREST_SIZE
_OF_PUSH = (PUSH, CROSS_TRACK)
_OF_CONTACT = (CONTACT_PUSH, CONTACT_CROSS_TRACK, PATH, PATH_CROSS_TRACK)
_OF_PATH = (PATH, PATH_CROSS_TRACK)

Wanted: TypeAlias = tuple[bool | None, bool | None, bool | None, bool | None]
"""Of push, contact push, path and face: True or None, see `relational`."""


class Columns:
    """Compiled variables, one column each.

    Parameters
    ----------
    names
        Of `COMPILED`; the columns of others mean nothing.

    Examples
    --------
    >>> Columns(["cross_track_error", "gap"]).rows.tolist()
    [160, 0]
    """

    def __init__(self, names: Sequence[str]) -> None:
        places = [COMPILED.index(name) if name in COMPILED else 0 for name in names]
        self.rows: IntArray = LANES * np.array(places, dtype=np.int64)
        push, contact, path, face = (
            bool(np.isin(self.rows, group).any()) or None
            for group in (_OF_PUSH, _OF_CONTACT, _OF_PATH, FACE_BEARING)
        )
        self.wanted: Wanted = (push, contact, path, face)
        self.of_away = AWAY_OTHERS in self.rows

    def of(self, view: View, robots: Sequence[int]) -> FloatArray:
        """Return the variables ``(len(robots), m, columns)`` of robots in the view's situations."""
        return relational(
            np.ascontiguousarray(view.robots.transpose(1, 2, 0)),
            np.ascontiguousarray(view.box.T),
            np.ascontiguousarray(view.gaps.T),
            view.goal,
            view.origin,
            float(view.before),
            view.periods,
            view.outline.edges,
            view.friction_radius,
            np.fromiter(robots, np.int64),
            self.rows,
            *self.wanted,
        )


@njit(cache=True, fastmath=_EXACT)
def angle_of(x: float, y: float) -> float:
    """Return the angle of a vector, as ``arctan2(y, x)`` to its last bits.

    The angle with the nearer axis or diagonal is below pi / 8; there the rational function of
    Moshier's Cephes library holds.
    """
    ax, ay = abs(x), abs(y)
    low, high = min(ax, ay), max(ax, ay)
    diagonal = low > 0.41421356237309503 * high
    top = low - high if diagonal else low
    bottom = low + high if diagonal else high
    t = top / (bottom if bottom > 0.0 else 1.0)
    z = t * t
    p = -8.750608600031904122785e-1
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    angle = t + t * (z * p / q)
    angle = 0.25 * pi + angle if diagonal else angle
    angle = 0.5 * pi - angle if ay > ax else angle
    angle = pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@njit(cache=True, fastmath=_EXACT)
def wrapped(angle: float) -> float:
    """Map an angle to [-pi, pi), as `wrap` but for last bits, on which published rows hang."""
    return angle - 2.0 * pi * np.floor((angle + pi) / (2.0 * pi))


@njit(cache=True, fastmath=_EXACT)
def _of_box(
    box: FloatArray,
    goal: FloatArray,
    before: float,
    periods: float,
    first: int,
    count: int,
    work: FloatArray,
) -> None:
    """Write how far the box has to go and has come, and how it is turned."""
    gx, gy, turned = goal[0], goal[1], goal[2]
    bx, by, psi = (
        box[0, first : first + count],
        box[1, first : first + count],
        box[2, first : first + count],
    )
    for k in range(count):
        dx, dy = gx - bx[k], gy - by[k]
        course, distance = angle_of(dx, dy), np.sqrt(dx * dx + dy * dy)
        work[_COURSE + k] = course
        work[_COS + k], work[_SIN + k] = np.cos(psi[k]), np.sin(psi[k])
        work[DISTANCE + k] = distance
        work[APPROACH + k] = (before - distance) / periods
        turn = wrapped(psi[k] - turned)
        work[TURN + k] = turn
        work[BEND + k] = wrapped(turn - 2.0 * wrapped(course - turned))


@njit(cache=True, fastmath=_EXACT)
def _of_middle(
    robots: FloatArray,
    gaps: FloatArray,
    touching: bool,
    box: FloatArray,
    goal: FloatArray,
    first: int,
    count: int,
    work: FloatArray,
    push: int,
    cross_track: int,
) -> None:
    """Write into two rows where the robots' middle would push the box, and its cross-track error.

    Those `touching` weigh more, see `View.contact_push`, or all the same.
    """
    for k in range(count):
        work[_X + k] = work[_Y + k] = work[_WEIGHT + k] = 0.0
    for r in range(len(robots)):
        x, y = robots[r, 0, first : first + count], robots[r, 1, first : first + count]
        apart = gaps[r, first : first + count]
        for k in range(count):
            weight = np.exp(-max(apart[k], 0.0) / CLOSE) + LEAST if touching else 1.0
            work[_X + k] += weight * x[k]
            work[_Y + k] += weight * y[k]
            work[_WEIGHT + k] += weight
    gx, gy = goal[0], goal[1]
    bx, by = box[0, first : first + count], box[1, first : first + count]
    for k in range(count):
        weight = work[_WEIGHT + k]
        dx, dy = bx[k] - work[_X + k] / weight, by[k] - work[_Y + k] / weight
        ahead, left = gx - bx[k], gy - by[k]
        work[push + k] = wrapped(angle_of(dx, dy) - work[_COURSE + k])
        length = np.sqrt(dx * dx + dy * dy)
        across = (ahead * dy - left * dx) / (length if length > 0.0 else 1.0)
        beyond = np.copysign(work[DISTANCE + k], across)
        work[cross_track + k] = across if ahead * dx + left * dy >= 0.0 else beyond


@njit(cache=True, fastmath=_EXACT)
def _of_robot(
    robot: FloatArray, gap: FloatArray, box: FloatArray, first: int, count: int, work: FloatArray
) -> None:
    """Write the gap of a robot, the bearing of the box from it, and on which side it stands."""
    x, y = robot[0, first : first + count], robot[1, first : first + count]
    bx, by = box[0, first : first + count], box[1, first : first + count]
    psi, apart = robot[2, first : first + count], gap[first : first + count]
    for k in range(count):
        azimuth = angle_of(bx[k] - x[k], by[k] - y[k])
        work[GAP + k] = apart[k]
        work[BEARING + k] = wrapped(azimuth - psi[k])
        work[SIDE + k] = wrapped(azimuth - work[_COURSE + k])


@njit(cache=True, fastmath=_EXACT)
def _of_face(
    robot: FloatArray, box: FloatArray, edges: FloatArray, first: int, count: int, work: FloatArray
) -> None:
    """Write the bearing of the way into the face of the box that is next to a robot.

    As `View.inward`: the direction to the nearest point from outside, away from it from inside.
    Rounding moves that point along the same line.
    """
    x, y, psi = (
        robot[0, first : first + count],
        robot[1, first : first + count],
        robot[2, first : first + count],
    )
    bx, by, turn = (
        box[0, first : first + count],
        box[1, first : first + count],
        box[2, first : first + count],
    )
    near = work[_NEAREST:]
    for k in range(count):
        cos, sin = work[_COS + k], work[_SIN + k]
        dx, dy = x[k] - bx[k], y[k] - by[k]
        near[rows.LOCAL_X + k] = cos * dx + sin * dy
        near[rows.LOCAL_Y + k] = cos * dy - sin * dx
    nearest_points(edges, near, count)
    for k in range(count):
        on_surface = near[rows.SQUARE + k] <= ON_SURFACE * ON_SURFACE  # straight across the edge
        side = near[rows.SIDE + k]
        ix = side * (near[rows.NEAR_X + k] - near[rows.LOCAL_X + k])
        iy = side * (near[rows.NEAR_Y + k] - near[rows.LOCAL_Y + k])
        ix = -near[rows.EDGE_Y + k] if on_surface else ix
        iy = near[rows.EDGE_X + k] if on_surface else iy
        work[FACE_BEARING + k] = wrapped(turn[k] + angle_of(ix, iy) - psi[k])


@njit(cache=True, fastmath=_EXACT)
def _of_path(
    box: FloatArray,
    origin: FloatArray,
    periods: float,
    edges: FloatArray,
    friction_radius: float,
    middle: FloatArray,
    first: int,
    count: int,
    work: FloatArray,
) -> None:
    """Write where the box is going and by how much it will miss the goal, see `View.path`.

    Behind `_of_middle` of those in contact, which it takes; `middle` ``(3, m)`` is scratch.
    """
    bx, by = box[0, first : first + count], box[1, first : first + count]
    for k in range(count):
        weight = work[_WEIGHT + k]
        middle[0, first + k] = work[_X + k] / weight
        middle[1, first + k] = work[_Y + k] / weight
        middle[2, first + k] = 0.0
    _of_face(middle, box, edges, first, count, work)
    x, y = middle[0, first : first + count], middle[1, first : first + count]
    for k in range(count):
        inward = work[FACE_BEARING + k]
        ux, uy = np.cos(inward), np.sin(inward)
        px, py = bx[k] - x[k], by[k] - y[k]
        mx, my = bx[k] - origin[0], by[k] - origin[1]
        depth, lever = px * ux + py * uy, py * ux - px * uy
        along, across = mx * ux + my * uy, my * ux - mx * uy
        drift = angle_of(abs(along) + STILL * periods, across)
        distance = work[DISTANCE + k]
        reach = 2.0 * friction_radius * friction_radius / max(distance, ARRIVED)
        path = inward + KEPT * drift + angle_of(max(depth, reach), lever)
        off = wrapped(path - work[_COURSE + k])
        work[PATH + k] = off
        ahead = min(max(off, -0.5 * pi), 0.5 * pi)
        work[PATH_CROSS_TRACK + k] = distance * np.sin(ahead)


@njit(cache=True, fastmath=_EXACT)
def _of_all(gaps: FloatArray, first: int, count: int, aways: FloatArray, work: FloatArray) -> None:
    """Write the two greatest gaps of all robots, how far each is away, and how many are."""
    for k in range(count):
        work[_WIDEST + k] = work[_SECOND + k] = -np.inf
        work[_AWAY + k] = 0.0
    for r in range(len(gaps)):
        gap = gaps[r, first : first + count]
        for k in range(count):
            widest = work[_WIDEST + k]
            work[_SECOND + k] = max(work[_SECOND + k], min(gap[k], widest))
            work[_WIDEST + k] = max(widest, gap[k])
            away = min(max(gap[k] / AWAY, 0.0), 1.0)
            aways[r, k] = away
            work[_AWAY + k] += away


@njit(cache=True, fastmath=_EXACT)
def _of_others(
    gaps: FloatArray, robot: int, first: int, count: int, aways: FloatArray, work: FloatArray
) -> None:
    """Write the greatest gap of the other robots and how many are away; of one alone its own."""
    n, gap = len(gaps), gaps[robot, first : first + count]
    share, alone = 1.0 / max(n - 1, 1), n == 1
    in_order = n <= IN_ORDER
    for k in range(count):
        work[AWAY_OTHERS + k] = 0.0 if in_order else share * (work[_AWAY + k] - aways[robot, k])
    for r in range(n if in_order else 0):
        if r != robot or alone:
            for k in range(count):
                work[AWAY_OTHERS + k] += share * aways[r, k]
    for k in range(count):
        others = work[_SECOND + k] if gap[k] == work[_WIDEST + k] else work[_WIDEST + k]
        work[OTHERS + k] = gap[k] if alone else others


@njit(cache=True)
def relational(
    robots: FloatArray,
    box: FloatArray,
    gaps: FloatArray,
    goal: FloatArray,
    origin: FloatArray,
    before: float,
    periods: float,
    edges: FloatArray,
    friction_radius: float,
    wanted: IntArray,
    columns: IntArray,
    of_push: bool | None,
    of_contact: bool | None,
    of_path: bool | None,
    of_face: bool | None,
) -> FloatArray:
    """Return relational shared blocks ``(robots wanted, m, columns)``.

    Parameters
    ----------
    robots, box, gaps
        ``(M, 3, m)``, ``(3, m)`` and ``(M, m)``: a `View`, its situations last.
    goal, origin, before, periods, edges, friction_radius
        Of the view and the outline of its box.
    wanted
        Indices of robots.
    columns
        Where the rows of the variables begin, see `Columns`.
    of_push, of_contact, of_path, of_face
        None where nothing is wanted that `_of_middle` of all or of those in contact, `_of_path` or
        `_of_face` writes: numba leaves out branches on None, so that this is not even compiled.
    """
    m, aways = box.shape[1], np.empty((len(gaps), LANES))
    out, work = np.empty((len(wanted), m, len(columns))), np.empty(_SIZE)
    middle = np.empty((3, m if of_path is not None else 0))
    for first in range(0, m, LANES):
        count = min(LANES, m - first)
        _of_box(box, goal, before, periods, first, count, work)
        _of_all(gaps, first, count, aways, work)
        if of_push is not None:
            _of_middle(robots, gaps, False, box, goal, first, count, work, PUSH, CROSS_TRACK)
        if of_contact is not None:
            _of_middle(
                robots, gaps, True, box, goal, first, count, work, CONTACT_PUSH, CONTACT_CROSS_TRACK
            )
        if of_path is not None:
            _of_path(box, origin, periods, edges, friction_radius, middle, first, count, work)
        for i in range(len(wanted)):
            r = wanted[i]
            _of_robot(robots[r], gaps[r], box, first, count, work)
            _of_others(gaps, r, first, count, aways, work)
            if of_face is not None:
                _of_face(robots[r], box, edges, first, count, work)
            for k in range(count):
                row = out[i, first + k]
                for c in range(len(columns)):
                    row[c] = work[columns[c] + k]
    return out
