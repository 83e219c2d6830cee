"""The relational variables of all robots in few situations, in the bits of their functions.

Learners sense by this, published rows hang on last bits: angles and exponentials are NumPy's, which
differ from compiled ones, and there is one call of either for all robots. What lies between is
compiled. A single situation of two robots takes a quarter of the time of the functions of
`relational`, which are the definition and the test oracle.
"""

from math import pi

import numpy as np

from ....core.numerics import FloatArray, IntArray, njit, wrap_one
from . import relational_lanes as lanes
from .relational import View, inward
from .relational_lanes import Columns

# Of the directions of a situation: from the box to the goal, in which the robots' middle pushes it,
# in which that of those in contact does, and from the robots to the box.
_COURSE, _PUSH, _CONTACT, _ROBOTS = range(4)
_NONE = np.empty((0, 0))


def sensed(view: View, columns: Columns) -> FloatArray:
    """Return the shared blocks ``(m, M, columns)`` of all robots; those of users mean nothing."""
    robots, boxes = np.ascontiguousarray(view.robots), np.ascontiguousarray(view.box)
    _, of_contact, of_path, _ = columns.wanted
    ways = _ways(robots, boxes, view.goal, view.contact if of_contact else boxes)
    return _columns(
        np.arctan2(ways[1], ways[0]),
        robots,
        boxes,
        np.ascontiguousarray(view.gaps),
        view.goal,
        view.distance,
        view.approach,
        view.path if of_path else view.distance,
        view.others_away if columns.of_away else _NONE,
        view.outline.edges,
        view.outline.rounding,
        columns.rows,
    )


@njit(cache=True)
def _ways(
    robots: FloatArray, boxes: FloatArray, goal: FloatArray, contact: FloatArray
) -> FloatArray:
    """Return the ways ``(2, m, 3 + M)`` of which directions are wanted [m]."""
    m, n, _ = robots.shape
    ways = np.empty((2, m, _ROBOTS + n))
    for c in range(m):
        for axis in range(2):
            at = boxes[c, axis]
            total = 0.0
            for r in range(n):
                total += robots[c, r, axis]
                ways[axis, c, _ROBOTS + r] = at - robots[c, r, axis]
            ways[axis, c, _COURSE] = goal[axis] - at
            ways[axis, c, _PUSH] = at - total / n
            ways[axis, c, _CONTACT] = at - contact[c, axis]
    return ways


@njit(cache=True)
def _columns(
    angles: FloatArray,
    robots: FloatArray,
    boxes: FloatArray,
    gaps: FloatArray,
    goal: FloatArray,
    distance: FloatArray,
    approach: FloatArray,
    path: FloatArray,
    away: FloatArray,
    edges: FloatArray,
    rounding: float,
    columns: IntArray,
) -> FloatArray:
    """Return the shared blocks ``(m, M, columns)``.

    Parameters
    ----------
    angles
        ``(m, 3 + M)`` directions [rad].
    robots, boxes, gaps, goal, distance, approach, path, away, edges, rounding
        Of the `View` and the outline of its box.
    columns
        Where the rows of the variables begin, see `Columns`.
    """
    m, n = gaps.shape
    out = np.empty((m, n, len(columns)))
    for k in range(len(columns)):
        column = columns[k]
        for c in range(m):
            course = angles[c, _COURSE]
            turn = wrap_one(boxes[c, 2] - goal[2])
            common = 0.0
            if column == lanes.DISTANCE:
                common = distance[c]
            elif column == lanes.APPROACH:
                common = approach[c]
            elif column == lanes.TURN:
                common = turn
            elif column == lanes.BEND:
                common = wrap_one(turn - 2.0 * wrap_one(course - goal[2]))
            elif column == lanes.PUSH or column == lanes.CROSS_TRACK:
                common = wrap_one(angles[c, _PUSH] - course)
            elif column == lanes.CONTACT_PUSH or column == lanes.CONTACT_CROSS_TRACK:
                common = wrap_one(angles[c, _CONTACT] - course)
            elif column == lanes.PATH or column == lanes.PATH_CROSS_TRACK:
                common = wrap_one(path[c] - course)
            if (
                column == lanes.CROSS_TRACK
                or column == lanes.CONTACT_CROSS_TRACK
                or column == lanes.PATH_CROSS_TRACK
            ):
                common = distance[c] * np.sin(min(max(common, -0.5 * pi), 0.5 * pi))
            for r in range(n):
                value = common
                if column == lanes.GAP:
                    value = gaps[c, r]
                elif column == lanes.BEARING:
                    value = wrap_one(angles[c, _ROBOTS + r] - robots[c, r, 2])
                elif column == lanes.SIDE:
                    value = wrap_one(angles[c, _ROBOTS + r] - course)
                elif column == lanes.FACE_BEARING:
                    into = inward(robots[c, r], boxes[c], edges, rounding)
                    value = wrap_one(into - robots[c, r, 2])
                elif column == lanes.AWAY_OTHERS:
                    value = away[c, r]
                elif column == lanes.OTHERS:
                    value = gaps[c, 0 if r or n == 1 else 1]
                    for other in range(n):
                        if other != r:
                            value = max(value, gaps[c, other])
                out[c, r, k] = value
    return out
