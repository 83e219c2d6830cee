"""Outlines of boxes for kernels: nearest points, distances and rays.

An outline is a set of directed edges with the material on their left: counter-clockwise around
the outside, clockwise around holes; concave shapes are no special case. A disc is a single edge of
no length, grown by its radius. Everything is in the frame of the box, in meters.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, njit
from ...angles import rotate

ON_SURFACE_M = 1e-12
"""Distance below which the direction to the nearest point is meaningless."""
CLEAR = 1e-9
"""Distance [m] from which a point is clearly before an edge, and the square of the distance from
its ends, over that from the edge: rounding can neither move it behind nor make an end nearer."""
LANES = 16
"""Points in one block, side by side for the vector instructions of the processor."""


def block_of(*rows: str) -> np.dtype[np.void]:
    """Return the type of a record with `LANES` numbers in each of the named rows.

    A compiled record does not keep its array alive. A kernel must therefore use the array after
    the last use of the record; indexing the array in every pass of a loop is enough.
    """
    return np.dtype((np.record, [(row, np.float64, (LANES,)) for row in rows]))


Records = np.ndarray[tuple[int], np.dtype[np.void]]
"""Array of such records."""
NEAREST = block_of("x", "y", "near_x", "near_y", "square", "side", "distance")
"""Points x, y, and their nearest points on the edges. The distance is negative inside."""


class BoxShape(NamedTuple):
    """Outline of a box, and how it resists turning."""

    edges: FloatArray
    """``(n_edges, 4)`` rows ``[x0, y0, x1, y1]`` [m], the material on the left."""
    radius: float
    """Radius of a disc, else 0 [m]."""
    friction_radius: float
    """Lever with which ground friction resists turning [m]."""


@njit(cache=True)
def _facing(edges: FloatArray, x: float, y: float) -> int:
    """Return the edge that a point stands before, if all of the outline is behind it; else -1."""
    for i in range(len(edges)):
        x0, y0 = edges[i, 0], edges[i, 1]
        dx, dy = edges[i, 2] - x0, edges[i, 3] - y0
        along, across = rotate(dx, -dy, x - x0, y - y0)
        if 0.0 < along < dx * dx + dy * dy and across < 0.0:
            for e in range(len(edges)):
                if rotate(dx, -dy, edges[e, 0] - x0, edges[e, 1] - y0)[1] < 0.0:
                    return -1
            return i
    return -1


@njit(cache=True, fastmath={"contract", "nsz"})
def _all_before(edge: FloatArray, points: np.record) -> bool:
    """Write the nearest points on one edge; return whether all points stand clearly before it.

    To these no other edge is nearer if all of the outline is behind this one.
    """
    x0, y0 = edge[0], edge[1]
    dx, dy = edge[2] - x0, edge[3] - y0
    length2 = dx * dx + dy * dy
    scale = 1.0 / length2
    clearance = CLEAR * np.sqrt(length2)
    before = 0
    for k in range(LANES):
        x, y = points.x[k], points.y[k]
        t = ((x - x0) * dx + (y - y0) * dy) * scale
        near_x, near_y = x0 + t * dx, y0 + t * dy
        square = (x - near_x) * (x - near_x) + (y - near_y) * (y - near_y)
        points.near_x[k] = near_x
        points.near_y[k] = near_y
        points.distance[k] = np.sqrt(square)
        end = t if t < 0.5 else 1.0 - t
        off = (x - x0) * dy - (y - y0) * dx
        clear = (end > 0.0) & (end * end * length2 > CLEAR * square) & (off > clearance)
        before += 1 if clear else 0
    return before == LANES


@njit(cache=True, fastmath={"contract", "nsz"})
def nearest_points(edges: FloatArray, points: np.record) -> None:
    """Write the nearest points and the signed distances of `LANES` points.

    Parameters
    ----------
    edges
        Edges of a `BoxShape`.
    points
        Record of the type `NEAREST`; `x` and `y` are read, the other rows are written.
    """
    face = _facing(edges, points.x[0], points.y[0])
    if face >= 0 and _all_before(edges[face], points):
        return
    for k in range(LANES):
        points.square[k] = np.inf
        points.side[k] = 1.0
    for i in range(len(edges)):
        x0, y0, x1, y1 = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3]
        dx, dy = x1 - x0, y1 - y0
        length2 = dx * dx + dy * dy
        scale = 1.0 / length2 if length2 > 0.0 else 0.0
        slope = dx / dy if dy != 0.0 else 0.0
        for k in range(LANES):
            x, y = points.x[k], points.y[k]
            t = ((x - x0) * dx + (y - y0) * dy) * scale
            t = t if t > 0.0 else 0.0
            t = t if t < 1.0 else 1.0
            near_x, near_y = x0 + t * dx, y0 + t * dy
            square = (x - near_x) * (x - near_x) + (y - near_y) * (y - near_y)
            nearer = square < points.square[k]
            points.square[k] = square if nearer else points.square[k]
            points.near_x[k] = near_x if nearer else points.near_x[k]
            points.near_y[k] = near_y if nearer else points.near_y[k]
            crosses = ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * slope)
            side = points.side[k]
            points.side[k] = -side if crosses else side
    for k in range(LANES):
        points.distance[k] = points.side[k] * np.sqrt(points.square[k])


@njit(cache=True)
def locate(x: float, y: float, edges: FloatArray, points: np.record) -> None:
    """Write the nearest point of one point to all lanes."""
    for k in range(LANES):
        points.x[k] = x
        points.y[k] = y
    nearest_points(edges, points)


@njit(cache=True)
def distances(xs: FloatArray, ys: FloatArray, shape: BoxShape) -> FloatArray:
    """Return the signed distances ``(m,)`` of points from the surface [m], negative inside.

    Examples
    --------
    >>> disc = BoxShape(np.zeros((1, 4)), radius=0.1, friction_radius=0.07)
    >>> distances(np.array([0.3, 0.0]), np.zeros(2), disc).round(12).tolist()
    [0.2, -0.1]
    """
    blocks = np.zeros(1, NEAREST)
    out = np.empty(len(xs))
    for first in range(0, len(xs), LANES):
        points = blocks[0]
        used = min(LANES, len(xs) - first)
        for k in range(LANES):  # unused lanes repeat the last point
            points.x[k] = xs[first + min(k, used - 1)]
            points.y[k] = ys[first + min(k, used - 1)]
        nearest_points(shape.edges, points)
        for k in range(used):
            out[first + k] = points.distance[k] - shape.radius
    return out


@njit(cache=True)
def surface(shape: BoxShape, x: float, y: float) -> tuple[float, float, float]:
    """Return the signed distance of one point from the surface [m], and the outward unit normal.

    On the surface the normal is not determined, and zero.
    """
    blocks = np.zeros(1, NEAREST)
    locate(x, y, shape.edges, blocks[0])
    distance = blocks[0].distance[0]
    near_x, near_y = blocks[0].near_x[0], blocks[0].near_y[0]
    scale = 1.0 / distance if abs(distance) > ON_SURFACE_M else 0.0
    return distance - shape.radius, scale * (x - near_x), scale * (y - near_y)


@njit(cache=True)
def gaps(robots: FloatArray, box: FloatArray, shape: BoxShape, radii: FloatArray) -> FloatArray:
    """Return the gaps ``(M,)`` between robots and a box [m], slightly negative in contact.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` poses.
    shape
        Outline of the box.
    radii
        ``(M,)`` radii of the robots.
    """
    xs, ys = np.empty(len(robots)), np.empty(len(robots))
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(len(robots)):
        xs[r], ys[r] = rotate(cos, -sin, robots[r, 0] - box[0], robots[r, 1] - box[1])
    out = distances(xs, ys, shape)
    for r in range(len(out)):
        out[r] -= radii[r]
    return out


@njit(cache=True)
def disc_hit(cx: float, cy: float, radius: float, dx: float, dy: float, reach: float) -> float:
    """Return the distance at which a ray from the origin enters a disc, or `reach`.

    A ray from inside enters at once, at distance 0.
    """
    square = cx * cx + cy * cy - radius * radius
    if square <= 0.0:
        return 0.0
    along = cx * dx + cy * dy
    root = along * along - square
    if along < 0.0 or root < 0.0:
        return reach
    return min(reach, along - sqrt(root))


@njit(cache=True)
def ray(shape: BoxShape, x: float, y: float, dx: float, dy: float, reach: float) -> float:
    """Return how far a ray travels before it meets an outline.

    Parameters
    ----------
    shape
        The outline.
    x, y
        Start of the ray [m].
    dx, dy
        Direction, a unit vector.
    reach
        Maximum length [m].

    Returns
    -------
    float
        Distance to the first hit [m]; `reach` if there is none; 0 if the ray first leaves material.
    """
    if shape.radius > 0.0:
        return disc_hit(-x, -y, shape.radius, dx, dy, reach)
    nearest = reach
    leaves = False
    for i in range(len(shape.edges)):
        x0, y0 = shape.edges[i, 0], shape.edges[i, 1]
        ex, ey = shape.edges[i, 2] - x0, shape.edges[i, 3] - y0
        cross = dx * ey - dy * ex
        if cross != 0.0:
            t = ((x0 - x) * ey - (y0 - y) * ex) / cross
            s = ((x0 - x) * dy - (y0 - y) * dx) / cross
            if 0.0 <= t < nearest and 0.0 <= s <= 1.0:
                nearest = t
                leaves = cross > 0.0
    return 0.0 if leaves else nearest
