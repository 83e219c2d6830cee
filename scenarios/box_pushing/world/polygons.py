"""Simple polygons, concave or with holes, as outlines of boxes.

Box2D takes convex polygons of at most 8 vertices and silently gets others wrong. Every polygon is
therefore checked, centered on its centroid and cut into convex pieces here.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from shapely.validation import explain_validity

from ....core.numerics import FloatArray
from .geometry import moments, ring_edges

Vertices = Sequence[tuple[float, float]]

UNIT = 10.0
"""Box2D units per metre."""
MAX_VERTICES = 8
"""Maximum number of vertices of a convex piece in Box2D, b2_maxPolygonVertices."""
MOST_VERTICES = 1000
"""Maximum number of vertices of an outline and its holes."""
LEAST_EDGE = 1e-6
"""Shortest edge [m]."""
LEAST_PIECE = 1.1921e-9
"""Smallest area of a convex piece [m2]: Box2D takes none below the epsilon of single precision."""
LARGEST = 100.0
"""Maximum distance between two vertices [m]."""
FAR = 10.0
"""Distance from the origin, in lengths of a polygon, beyond which its vertices are taken relative
to its first one: moments about a far origin lose all digits."""
RESOLUTION = 1e-7
"""Coarsest spacing of floating-point coordinates, in lengths of a polygon."""
STRAIGHT = 1e-9
"""Sine of the angle between edges that counts as straight on."""


def polygon_edges(polygon: Polygon) -> FloatArray:
    """Return the edges ``(n, 4)`` of an oriented polygon and its holes, material on the left."""
    rings = [polygon.exterior, *polygon.interiors]
    return np.vstack([ring_edges(np.asarray(ring.coords)[:-1]) for ring in rings])


def centred_polygon(
    name: str, vertices: Vertices, holes: Sequence[Vertices] = ()
) -> tuple[Polygon, FloatArray]:
    """Return a checked polygon around its centroid, and where the centroid was ``(2,)`` [m].

    A clockwise outline is reversed with a warning.

    Raises
    ------
    ValueError
        If the polygon has more than `MOST_VERTICES`, is too large, has two vertices at one place,
        crosses or touches itself, has no area, or a vertex is not finite or too far away for its
        floating-point coordinates. Fewer than 3 vertices are refused by `BoxSettings`.
    """
    for ring in (vertices, *holes):
        _check_ring(f"box {name!r}", ring)
    if (count := sum(map(len, (vertices, *holes)))) > MOST_VERTICES:
        raise ValueError(f"box {name!r}: {count} vertices, allowed: {MOST_VERTICES} or fewer")
    polygon = Polygon(vertices, holes)
    if not polygon.is_valid:
        raise ValueError(f"box {name!r}: not a simple polygon: {explain_validity(polygon)}")
    origin = nearby_origin(vertices)
    polygon = translate(polygon, *-origin)
    if not polygon.area > 1e-6 * polygon.length**2:
        raise ValueError(
            f"box {name!r}: area {polygon.area:.3g} m2 within {polygon.length:.3g} m of outline, "
            "degenerate"
        )
    if not polygon.exterior.is_ccw:
        warnings.warn(f"box {name!r}: clockwise outline, was reversed", stacklevel=2)
    polygon = orient(polygon)
    area = moments(polygon_edges(polygon))
    centroid = area.first / area.area
    return translate(polygon, *-centroid), origin + centroid


def nearby_origin(vertices: Vertices) -> FloatArray:
    """Return the point ``(2,)`` that vertices are taken relative to: the first if all are far."""
    ring = np.asarray(vertices, dtype=float)
    is_far = np.abs(ring).max() > FAR * np.ptp(ring, axis=0).max()
    return ring[0] if is_far else np.zeros(2)


def _check_ring(box: str, vertices: Vertices) -> None:
    """Refuse an outline that no body can have."""
    ring = np.asarray(vertices, dtype=float)
    if not np.isfinite(ring).all():
        raise ValueError(f"{box}: a vertex that is not finite, allowed: numbers in metres")
    # Halved before they are subtracted: the difference of two numbers may overflow.
    extent = 2 * float(np.ptp(ring / 2, axis=0).max())
    if extent > LARGEST:
        raise ValueError(f"{box}: is {extent:.3g} m long, allowed: up to {LARGEST:g} m")
    spacing = float(np.spacing(np.abs(ring).max()))
    if spacing > RESOLUTION * extent > 0:
        raise ValueError(
            f"{box}: coordinates of {np.abs(ring).max():.3g} m are {spacing:.2g} m apart, too "
            f"coarse for {extent:.3g} m of outline, allowed: coordinates from a point nearby"
        )
    edges = np.roll(ring, -1, axis=0) - ring
    short = np.flatnonzero(np.hypot(edges[:, 0], edges[:, 1]) < LEAST_EDGE)
    if len(short):
        first = short[0] + 1
        second = (short[0] + 1) % len(ring) + 1
        raise ValueError(
            f"{box}: vertices {first} and {second} are at the same place {vertices[short[0]]}, "
            "allowed: each once, the first not again at the end"
        )


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
