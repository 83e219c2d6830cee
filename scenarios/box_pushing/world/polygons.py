"""Simple polygons, concave or with holes, as outlines of boxes.

Box2D takes convex polygons of at most 8 vertices and silently gets others wrong. Every polygon is
therefore checked and cut into convex pieces here.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from shapely.validation import explain_validity

from ....core.numerics import FloatArray, quadrature

Vertices = Sequence[tuple[float, float]]

UNIT = 10.0
"""Box2D units per meter."""
MAX_VERTICES = 8
"""Maximum number of vertices of a convex piece in Box2D, b2_maxPolygonVertices."""
MOST_VERTICES = 1000
"""Maximum number of vertices of an outline and its holes."""
LEAST_EDGE = 1e-6
"""Shortest edge [m]."""
LEAST_PIECE = 1.1921e-9
"""Smallest area of a convex piece [m2]: Box2D takes none below the epsilon of single precision."""
FARTHEST = 100.0
"""Maximum coordinate of a vertex [m], relative to `nearby_origin`."""
FAR = 10.0
"""Distance from the origin, in lengths of a polygon, beyond which vertices are counted from the
first of them."""
RESOLUTION = 1e-7
"""Coarsest spacing of floating-point coordinates, in lengths of a polygon."""
STRAIGHT = 1e-9
"""Sine of the angle between edges that counts as straight on."""


Moments = tuple[float, FloatArray, float]
"""Moments of an area about the origin: the area [m2], the integrals ``(2, 2)`` of the products of
coordinates [m4], and the integral of the distance from the origin [m3]."""


def moments(edges: FloatArray) -> Moments:
    """Return the moments of the area within directed edges ``(n, 4)``, material on the left.

    They are sums over the signed triangles between the origin and each edge, exact except for
    the last one, which is a 64-point Gauss-Legendre quadrature along each edge.
    """
    a = edges[:, :2]
    b = edges[:, 2:]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    second = sum(np.einsum("n,ni,nj->ij", cross, p, p) for p in (a, b, a + b)) / 24
    nodes, weights = quadrature(64)
    t = (nodes + 1) / 2
    points = a[:, None] + t[:, None] * (b - a)[:, None]
    mean_distance = np.hypot(points[..., 0], points[..., 1]) @ weights / 2
    return float(cross.sum() / 2), second, float((cross * mean_distance).sum() / 3)


def ring_edges(vertices: FloatArray) -> FloatArray:
    """Return the edges ``(n, 4)`` of a closed ring of vertices ``(n, 2)``."""
    return np.hstack([vertices, np.roll(vertices, -1, axis=0)])


def polygon_edges(polygon: Polygon) -> FloatArray:
    """Return the edges ``(n, 4)`` of an oriented polygon and its holes, material on the left."""
    rings = [polygon.exterior, *polygon.interiors]
    return np.vstack([ring_edges(np.asarray(ring.coords)[:-1]) for ring in rings])


def nearby_origin(name: str, vertices: Vertices) -> FloatArray:
    """Return the point ``(2,)`` from which vertices are counted: the first one if all are far away.

    Map coordinates are far away: moments about their origin would lose all digits.

    Raises
    ------
    ValueError
        If the coordinates are too coarse for the size of the polygon.
    """
    ring = np.asarray(vertices, dtype=float)
    farthest = float(np.abs(ring).max())
    with np.errstate(over="ignore", invalid="ignore"):
        size = float(np.ptp(ring, axis=0).max())
    spacing = float(np.spacing(farthest))
    if spacing > RESOLUTION * size > 0:
        raise ValueError(
            f"box {name!r}: coordinates of {farthest:.3g} m are {spacing:.2g} m apart, too coarse "
            f"for {size:.3g} m of outline, allowed: coordinates from a point nearby"
        )
    return ring[0] if farthest > FAR * size else np.zeros(2)


def checked_polygon(name: str, vertices: Vertices, holes: Sequence[Vertices] = ()) -> Polygon:
    """Return an oriented polygon.

    A clockwise outline is reversed with a warning.

    Raises
    ------
    ValueError
        If the polygon has more than `MOST_VERTICES`, a vertex is not finite or too far away, two
        vertices are at one place, or it crosses or touches itself or has no area.
    """
    rings = [np.asarray(ring, dtype=float).reshape(-1, 2) for ring in (vertices, *holes)]
    points = np.vstack(rings)
    if len(points) > MOST_VERTICES:
        raise ValueError(f"box {name!r}: {len(points)} vertices, allowed: {MOST_VERTICES} or fewer")
    for x, y in points[~(np.abs(points) <= FARTHEST).all(axis=1)]:
        raise ValueError(
            f"box {name!r}: vertex ({x:g}, {y:g}), coordinates must be at most {FARTHEST:g} m"
        )
    for ring in rings:
        steps = np.hypot(*(ring - np.roll(ring, 1, axis=0)).T)
        for x, y in ring[steps < LEAST_EDGE]:
            raise ValueError(
                f"box {name!r}: two vertices at the same place ({x:g}, {y:g}), allowed: each "
                "once, the first not again at the end"
            )
    polygon = Polygon(vertices, holes)
    if not polygon.is_valid:
        raise ValueError(f"box {name!r}: not a simple polygon: {explain_validity(polygon)}")
    if not polygon.area > 1e-6 * polygon.length**2:
        raise ValueError(
            f"box {name!r}: area {polygon.area:.3g} m2 within {polygon.length:.3g} m of outline, "
            "degenerate"
        )
    if not polygon.exterior.is_ccw:
        warnings.warn(f"box {name!r}: clockwise outline, was reversed", stacklevel=2)
    return orient(polygon)


def _turns(ring: FloatArray) -> FloatArray:
    """Return the sine of the turn at every vertex of a ring ``(n, 2)``."""
    into = ring - np.roll(ring, 1, axis=0)
    out = np.roll(ring, -1, axis=0) - ring
    cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
    return cross / (np.linalg.norm(into, axis=1) * np.linalg.norm(out, axis=1))


def _convex_union(first: Polygon, second: Polygon) -> Polygon | None:
    """Return the union of two convex polygons that share an edge, or None unless Box2D takes it."""
    if len({*first.exterior.coords} & {*second.exterior.coords}) < 2:
        return None
    union = shapely.union(first, second)
    if not isinstance(union, Polygon) or union.interiors:
        return None
    ring = np.asarray(orient(union).exterior.coords)[:-1]
    ring = ring[np.abs(_turns(ring)) > STRAIGHT]
    return Polygon(ring) if len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all() else None


def convex_pieces(polygon: Polygon) -> tuple[FloatArray, ...]:
    """Return convex counter-clockwise pieces ``(<= 8, 2)`` that together are the polygon.

    The pieces are constrained Delaunay triangles. Each is merged with earlier pieces as long as the
    union is convex.
    """
    ring = np.asarray(polygon.exterior.coords)[:-1]
    if not polygon.interiors and len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all():
        return (ring,)
    pieces: list[Polygon] = []
    for triangle in shapely.constrained_delaunay_triangles(polygon).geoms:
        if triangle.area > 0:
            piece = triangle
            for other in [*reversed(pieces)]:
                union = _convex_union(other, piece)
                if union is not None:
                    pieces.remove(other)
                    piece = union
            pieces.append(piece)
    return tuple(np.asarray(orient(piece).exterior.coords)[:-1] for piece in pieces)


def box2d_area(piece: FloatArray) -> float:
    """Return the area of a piece ``(n, 2)`` as Box2D computes it, in single precision [m2]."""
    x, y = (piece * UNIT).astype(np.float32).T
    return float(sum(x * np.roll(y, -1) - y * np.roll(x, -1), np.float32(0))) / 2 / UNIT**2
