"""Outlines of bodies: distance to the surface, and rays.

An outline is a set of directed edges with the material on their left: counter-clockwise around
the outside, clockwise around holes; concave shapes are no special case. `rounding` grows the shape
by a margin all around, so that a single degenerate edge with rounding R is a circle of radius R.
Everything is in the frame of the body, metres, centre of mass at the origin.

All are compiled and may be called from other compiled kernels. `nearest_points` is what `surface`
computes first, once more: for `LANES` points side by side, without a branch. That takes a fifth of
the time of `surface`, point by point; a test compares them.

An infrared sensor looks along one ray from the rim of its robot and reads a number in [0, 1]: 1
when touching, 0 when nothing is within its reach, and between them as `InfraredSettings` say.
"""

from dataclasses import dataclass
from math import exp, hypot, sqrt
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, njit, quadrature

ON_SURFACE = 1e-12
"""Distance below which the direction to the nearest point is meaningless [m]."""
CLEAR = 1e-9
"""Distance [m] from which a point is clearly before an edge, and the square of the distance from
its ends, over that from the edge: rounding can neither move it behind nor make an end nearer."""
LANES = 16
"""Points side by side, see `nearest_points`."""
LOCAL_X, LOCAL_Y, SQUARE, NEAR_X, NEAR_Y, SIDE, EDGE_X, EDGE_Y = range(0, 8 * LANES, LANES)
"""Offsets of the rows of `nearest_points`."""
NEAREST_SIZE = EDGE_Y + LANES


@dataclass(frozen=True, eq=False)
class Outline:
    """The surface of a body.

    Examples
    --------
    >>> disc = Outline(np.zeros((1, 4)), rounding=0.1)
    >>> distance, nx, ny, px, py = surface(disc.edges, disc.rounding, 0.3, 0.0)
    >>> round(distance, 12), nx, ny, px, py
    (0.2, 1.0, 0.0, 0.1, 0.0)
    """

    edges: FloatArray
    """``(n_edges, 4)`` rows ``[x0, y0, x1, y1]`` [m], the material on the left."""
    rounding: float = 0.0
    """Margin by which the shape is grown [m]."""

    @property
    def radius(self) -> float:
        """Distance of the farthest surface point from the origin [m]."""
        ends = self.edges.reshape(-1, 2)
        return float(np.hypot(ends[:, 0], ends[:, 1]).max()) + self.rounding


class BoxShape(NamedTuple):
    """Outline of a box, and how it resists turning, for kernels."""

    edges: FloatArray
    """Edges of the `Outline` ``(n_edges, 4)`` [m]."""
    rounding: float
    """Margin by which the outline is grown [m]."""
    friction_radius: float
    """Lever with which ground friction resists turning [m]."""


def ring_edges(vertices: FloatArray) -> FloatArray:
    """Return the edges ``(n, 4)`` of a closed ring of vertices ``(n, 2)``."""
    return np.hstack([vertices, np.roll(vertices, -1, axis=0)])


@njit(cache=True)
def surface(
    edges: FloatArray, rounding: float, x: float, y: float
) -> tuple[float, float, float, float, float]:
    """Return where a point stands relative to an outline.

    Parameters
    ----------
    edges, rounding
        An `Outline`.
    x, y
        The point [m].

    Returns
    -------
    distance : float
        Signed distance to the surface [m], negative inside.
    nx, ny : float
        Outward unit normal at the nearest surface point.
    px, py : float
        The nearest surface point [m].
    """
    best = np.inf
    qx = qy = ex = ey = 0.0
    inside = False
    for i in range(edges.shape[0]):
        x0, y0 = edges[i, 0], edges[i, 1]
        dx, dy = edges[i, 2] - x0, edges[i, 3] - y0
        length2 = dx * dx + dy * dy
        t = 0.0
        if length2 > 0.0:
            t = min(max(((x - x0) * dx + (y - y0) * dy) / length2, 0.0), 1.0)
        cx, cy = x0 + t * dx, y0 + t * dy
        square = (x - cx) ** 2 + (y - cy) ** 2
        if square < best:
            best, qx, qy, ex, ey = square, cx, cy, dx, dy
        if (y0 > y) != (y0 + dy > y) and x < x0 + (y - y0) / dy * dx:
            inside = not inside
    side = -1.0 if inside else 1.0
    distance = sqrt(best)
    if distance > 1e-12:  # ON_SURFACE
        nx, ny = side * (x - qx) / distance, side * (y - qy) / distance
    else:
        length = hypot(ex, ey)
        if length > 0.0:  # the material is on the left of the edge
            nx, ny = ey / length, -ex / length
        else:
            nx, ny = 1.0, 0.0
    return side * distance - rounding, nx, ny, qx + rounding * nx, qy + rounding * ny


@njit(cache=True)
def _facing(edges: FloatArray, x: float, y: float) -> int:
    """Return the edge that a point stands before, if all of the outline is behind it; else -1."""
    for i in range(len(edges)):
        x0, y0 = edges[i, 0], edges[i, 1]
        dx, dy = edges[i, 2] - x0, edges[i, 3] - y0
        length2 = dx * dx + dy * dy
        along, across = (x - x0) * dx + (y - y0) * dy, (y - y0) * dx - (x - x0) * dy
        if 0.0 < along < length2 and across < 0.0:
            behind = True
            for e in range(len(edges)):
                depth = (edges[e, 1] - y0) * dx - (edges[e, 0] - x0) * dy
                behind = behind and depth >= 0.0
            return i if behind else -1
    return -1


@njit(cache=True, fastmath={"contract", "nsz"})
def _ahead_of(edge: FloatArray, rows: FloatArray, lanes: int) -> int:
    """Write the nearest points on one edge; return how many points stand clearly before it.

    To these no other edge is nearer, as all of the outline is behind this one.
    """
    x0, y0 = edge[0], edge[1]
    dx, dy = edge[2] - x0, edge[3] - y0
    length2 = dx * dx + dy * dy
    scale = 1.0 / length2
    least = CLEAR * np.sqrt(length2)
    before = 0
    for k in range(lanes):
        x, y = rows[LOCAL_X + k], rows[LOCAL_Y + k]
        t = ((x - x0) * dx + (y - y0) * dy) * scale
        cx, cy = x0 + t * dx, y0 + t * dy
        square = (x - cx) * (x - cx) + (y - cy) * (y - cy)
        rows[SQUARE + k] = square
        rows[NEAR_X + k] = cx
        rows[NEAR_Y + k] = cy
        rows[SIDE + k] = 1.0
        end = t if t < 0.5 else 1.0 - t
        off = (x - x0) * dy - (y - y0) * dx
        clear = (end > 0.0) & (end * end * length2 > CLEAR * square) & (off > least)
        before += 1 if clear else 0
    return before


@njit(cache=True, fastmath={"contract", "nsz"})
def nearest_points(edges: FloatArray, rows: FloatArray, lanes: int) -> None:
    """Write for each of some points the nearest point of an outline without rounding.

    Parameters
    ----------
    edges
        Of an `Outline`.
    rows
        Scratch of `NEAREST_SIZE`. Read are the points ``LOCAL_X``, ``LOCAL_Y``; written are the
        square of the distance, the nearest point, ``SIDE``, -1 inside and 1 outside, and of points
        on the surface the unit vector along the edge.
    lanes
        How many points, at most `LANES`.
    """
    face = _facing(edges, rows[LOCAL_X], rows[LOCAL_Y])
    if face >= 0 and _ahead_of(edges[face], rows, lanes) == lanes:
        return
    for k in range(lanes):
        rows[SQUARE + k] = np.inf
        rows[SIDE + k] = 1.0
    for i in range(len(edges)):
        x0, y0, x1, y1 = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3]
        dx, dy = x1 - x0, y1 - y0
        length2 = dx * dx + dy * dy
        scale = 1.0 / length2 if length2 > 0.0 else 0.0
        slope = dx / dy if dy != 0.0 else 0.0
        for k in range(lanes):
            x, y = rows[LOCAL_X + k], rows[LOCAL_Y + k]
            t = ((x - x0) * dx + (y - y0) * dy) * scale
            t = t if t > 0.0 else 0.0
            t = t if t < 1.0 else 1.0
            cx, cy = x0 + t * dx, y0 + t * dy
            square = (x - cx) * (x - cx) + (y - cy) * (y - cy)
            nearer = square < rows[SQUARE + k]
            rows[SQUARE + k] = square if nearer else rows[SQUARE + k]
            rows[NEAR_X + k] = cx if nearer else rows[NEAR_X + k]
            rows[NEAR_Y + k] = cy if nearer else rows[NEAR_Y + k]
            rows[EDGE_X + k] = i if nearer else rows[EDGE_X + k]
            crosses = ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * slope)
            side = rows[SIDE + k]
            rows[SIDE + k] = -side if crosses else side
    on_surface = 0
    for k in range(lanes):
        on_surface += 1 if rows[SQUARE + k] <= ON_SURFACE * ON_SURFACE else 0
    for k in range(lanes if on_surface > 0 else 0):
        if rows[SQUARE + k] <= ON_SURFACE * ON_SURFACE:
            edge = edges[int(rows[EDGE_X + k])]
            dx, dy = edge[2] - edge[0], edge[3] - edge[1]
            length2 = dx * dx + dy * dy
            rows[EDGE_X + k] = dx / np.sqrt(length2) if length2 > 0.0 else 0.0
            rows[EDGE_Y + k] = dy / np.sqrt(length2) if length2 > 0.0 else 1.0


@njit(cache=True)
def gaps(
    robots: FloatArray, boxes: FloatArray, edges: FloatArray, rounding: float, radii: FloatArray
) -> FloatArray:
    """Return the gaps ``(m,)`` between round bodies and boxes [m], slightly negative in contact.

    Parameters
    ----------
    robots, boxes
        ``(m, 3)`` and ``(m, 3)`` or ``(1, 3)`` poses.
    edges, rounding
        Outline of the boxes.
    radii
        ``(m,)`` of the bodies.
    """
    out = np.empty(len(robots))
    for c in range(len(robots)):
        box = boxes[c % len(boxes)]
        cos, sin = np.cos(box[2]), np.sin(box[2])
        dx, dy = robots[c, 0] - box[0], robots[c, 1] - box[1]
        near = surface(edges, rounding, cos * dx + sin * dy, cos * dy - sin * dx)
        out[c] = near[0] - radii[c]
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
def _ray_edge(
    edge: tuple[float, float, float, float],
    origin: tuple[float, float],
    direction: tuple[float, float],
    reach: float,
) -> float:
    """Return the distance at which a ray crosses a segment (x0, y0, x1, y1), or `reach`."""
    x0, y0, x1, y1 = edge
    dx, dy = direction
    ex, ey = x1 - x0, y1 - y0
    cross = dx * ey - dy * ex
    if cross == 0.0:
        return reach
    t = ((x0 - origin[0]) * ey - (y0 - origin[1]) * ex) / cross
    s = ((x0 - origin[0]) * dy - (y0 - origin[1]) * dx) / cross
    return t if 0.0 <= t < reach and 0.0 <= s <= 1.0 else reach


@njit(cache=True)
def ray(
    edges: FloatArray, rounding: float, x: float, y: float, dx: float, dy: float, reach: float
) -> float:
    """Return how far a ray travels before it meets an outline.

    Parameters
    ----------
    edges, rounding
        An `Outline`.
    x, y
        Where the ray starts [m].
    dx, dy
        Its direction, a unit vector.
    reach
        Its greatest length [m].

    Returns
    -------
    float
        Distance to the first hit [m]; `reach` if there is none; 0 if the ray starts inside.
    """
    if surface(edges, rounding, x, y)[0] <= 0.0:
        return 0.0
    best = reach
    for i in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3]
        if rounding > 0.0:
            best = disc_hit(x0 - x, y0 - y, rounding, dx, dy, best)
            length = hypot(x1 - x0, y1 - y0)
            if length > 0.0:  # the ring closes, so the other end is some edge's start
                ox, oy = rounding * (y1 - y0) / length, -rounding * (x1 - x0) / length
                moved = x0 + ox, y0 + oy, x1 + ox, y1 + oy
                best = _ray_edge(moved, (x, y), (dx, dy), best)
        else:
            best = _ray_edge((x0, y0, x1, y1), (x, y), (dx, dy), best)
    return best


@njit(cache=True)
def response(distance: float, reach: float, decay: float, kind: int) -> float:
    """Return what `InfraredSettings.reading` returns at a distance below `reach`."""
    if kind == 0:
        return exp(-distance / decay)
    return 1.0 - distance / reach if kind == 1 else 1.0


class InfraredSensors(NamedTuple):
    """Infrared sensors of M round robots, S on each, for kernels."""

    radii: FloatArray
    """``(M,)`` radii of the robots [m]."""
    directions: FloatArray
    """``(M, S)`` directions of the sensors in the body frame [rad]."""
    reach: float
    """See `InfraredSettings`, as what follows."""
    decay: float
    kind: int


@njit(cache=True)
def infrared_readings(
    robots: FloatArray,
    box: FloatArray,
    edges: FloatArray,
    rounding: float,
    sensors: InfraredSensors,
) -> FloatArray:
    """Return the readings of the sensors of all robots.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` poses.
    edges, rounding
        Outline of the box.
    sensors
        The sensors.

    Returns
    -------
    FloatArray
        ``(2, M, S)`` readings in [0, 1]: of the box alone, and of the other robots alone.
    """
    radii, directions, reach, decay, kind = sensors
    n, s = directions.shape
    out = np.zeros((2, n, s))
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(n):
        dx, dy = robots[r, 0] - box[0], robots[r, 1] - box[1]
        bx, by = cos * dx + sin * dy, cos * dy - sin * dx
        sees_box = surface(edges, rounding, bx, by)[0] < radii[r] + reach
        for k in range(s):
            angle = robots[r, 2] + directions[r, k]
            ux, uy = np.cos(angle), np.sin(angle)
            if sees_box:
                lx, ly = cos * ux + sin * uy, cos * uy - sin * ux
                distance = ray(
                    edges, rounding, bx + radii[r] * lx, by + radii[r] * ly, lx, ly, reach
                )
                if distance < reach:
                    out[0, r, k] = response(distance, reach, decay, kind)
            nearest = reach
            for o in range(n):
                if o == r:
                    continue
                ox, oy = robots[o, 0] - robots[r, 0], robots[o, 1] - robots[r, 1]
                span = radii[r] + radii[o] + reach
                if ox * ox + oy * oy < span * span:
                    nearest = disc_hit(
                        ox - radii[r] * ux, oy - radii[r] * uy, radii[o], ux, uy, nearest
                    )
            if nearest < reach:
                out[1, r, k] = response(nearest, reach, decay, kind)
    return out


class Moments(NamedTuple):
    """Area and its moments about the origin."""

    area: float
    """Area [m2]."""
    first: FloatArray
    """``(2,)`` integrals of x and y [m3]."""
    second: FloatArray
    """``(2, 2)`` integrals of the products of coordinates [m4]."""
    radial: float
    """Integral of the distance from the origin [m3]."""


def moments(edges: FloatArray) -> Moments:
    """Return the moments of the area within directed edges ``(n, 4)``, material on the left.

    Sums over the signed triangles between the origin and each edge; exact but for `radial`, which
    is a 64-point Gauss-Legendre quadrature along each edge.
    """
    a = edges[:, :2]
    b = edges[:, 2:]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = cross.sum() / 2
    ends = a + b
    first = (cross[:, None] * ends).sum(axis=0) / 6
    outer = sum(np.einsum("n,ni,nj->ij", cross, p, p) for p in (a, b, ends)) / 24
    nodes, weights = quadrature(64)
    t = (nodes + 1) / 2
    points = a[:, None] + t[:, None] * (b - a)[:, None]
    mean_distance = np.hypot(points[..., 0], points[..., 1]) @ weights / 2
    return Moments(float(area), first, outer, float((cross * mean_distance).sum() / 3))
