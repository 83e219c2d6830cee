"""Outlines of bodies: distance to the surface, and rays.

An outline is a set of directed edges with the material on their left: counter-clockwise around
the outside, clockwise around holes; concave shapes are no special case. `rounding` grows the shape
by a margin all around, so that a single degenerate edge with rounding R is a circle of radius R.
Everything is in the frame of the body, metres, centre of mass at the origin.

`surface` and `ray` are compiled and may be called from other compiled kernels; `surface_numpy` and
`ray_numpy` compute the same without loops and are their test oracle.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf, sqrt

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.numerics.compiling import njit

ON_SURFACE = 1e-12
"""Distance below which the direction to the nearest point is meaningless [m]."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The surface of a body.

    Attributes
    ----------
    edges
        ``(n_edges, 4)`` rows ``[x0, y0, x1, y1]`` [m], the material on the left.
    rounding
        Margin by which the shape is grown [m].

    Examples
    --------
    >>> disc = Outline(np.zeros((1, 4)), rounding=0.1)
    >>> distance, nx, ny, px, py = surface(disc.edges, disc.rounding, 0.3, 0.0)
    >>> round(distance, 12), nx, ny, px, py
    (0.2, 1.0, 0.0, 0.1, 0.0)
    """

    edges: FloatArray
    rounding: float = 0.0

    def __post_init__(self) -> None:
        if self.edges.ndim != 2 or self.edges.shape[1] != 4 or not len(self.edges):
            raise ValueError(f"outline: edges have shape {self.edges.shape}, allowed (n >= 1, 4)")
        if not (np.isfinite(self.edges).all() and 0 <= self.rounding < inf):
            raise ValueError("outline: edges and rounding must be finite, rounding not negative")

    @property
    def radius(self) -> float:
        """Distance of the farthest surface point from the origin [m]."""
        ends = self.edges.reshape(-1, 2)
        return float(np.hypot(ends[:, 0], ends[:, 1]).max()) + self.rounding


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
    qx = qy = 0.0
    ex = ey = 0.0
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


def surface_numpy(
    edges: FloatArray, rounding: float, x: float, y: float
) -> tuple[float, float, float, float, float]:
    """Return what `surface` returns, by array operations on all edges at once."""
    point = np.array([x, y])
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    length2 = (along**2).sum(axis=1)
    dots = ((point - start) * along).sum(axis=1)
    t = np.clip(np.divide(dots, length2, out=np.zeros_like(dots), where=length2 > 0), 0, 1)
    closest = start + t[:, None] * along
    squares = ((point - closest) ** 2).sum(axis=1)
    i = int(squares.argmin())
    end_y = start[:, 1] + along[:, 1]
    spans = (start[:, 1] > y) != (end_y > y)
    slope = np.divide(along[:, 0], along[:, 1], out=np.zeros_like(dots), where=spans)
    inside = bool((spans & (x < start[:, 0] + (y - start[:, 1]) * slope)).sum() % 2)
    side = -1.0 if inside else 1.0
    distance = float(np.sqrt(squares[i]))
    normal = np.array([1.0, 0.0])
    if distance > ON_SURFACE:
        normal = side * (point - closest[i]) / distance
    elif length2[i] > 0:
        normal = np.array([along[i, 1], -along[i, 0]]) / np.sqrt(length2[i])
    px, py = closest[i] + rounding * normal
    return side * distance - rounding, float(normal[0]), float(normal[1]), float(px), float(py)


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
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    x: float,
    y: float,
    dx: float,
    dy: float,
    reach: float,
) -> float:
    """Return the distance at which a ray crosses a segment, or `reach`."""
    ex, ey = x1 - x0, y1 - y0
    cross = dx * ey - dy * ex
    if cross == 0.0:
        return reach
    t = ((x0 - x) * ey - (y0 - y) * ex) / cross
    s = ((x0 - x) * dy - (y0 - y) * dx) / cross
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
                best = _ray_edge(x0 + ox, y0 + oy, x1 + ox, y1 + oy, x, y, dx, dy, best)
        else:
            best = _ray_edge(x0, y0, x1, y1, x, y, dx, dy, best)
    return best


def ray_numpy(
    edges: FloatArray, rounding: float, x: float, y: float, dx: float, dy: float, reach: float
) -> float:
    """Return what `ray` returns, by marching the signed distance of `surface_numpy`.

    A step as long as the distance to the surface never passes through it, so the march converges
    on the first hit; a grazing ray may take many steps and is given up after 2000.
    """
    travelled = 0.0
    for _ in range(2000):
        distance = surface_numpy(edges, rounding, x + travelled * dx, y + travelled * dy)[0]
        if distance <= 1e-10:
            break
        travelled += distance
        if travelled >= reach:
            return reach
    return travelled
