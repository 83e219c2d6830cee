"""Polygons as bodies: checked, centred on their centre of mass, cut into convex pieces.

Box2D takes convex polygons of at most 8 vertices and silently gets others wrong, so that any simple
polygon, concave or with holes, goes through here first.
"""

import warnings
from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from itertools import combinations
from typing import NamedTuple

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from shapely.validation import explain_validity

from ....core.numerics import FloatArray
from ....core.plugins.deferred import nx
from .geometry import ring_edges

Vertices = Sequence[tuple[float, float]]

MAX_VERTICES = 8
"""Of a convex piece; b2_maxPolygonVertices."""
MOST_VERTICES = 1000
"""Of an outline and its holes; a drawing with more is to be simplified."""
LEAST_EDGE, LARGEST = 1e-6, 100.0
"""Shortest edge, and greatest distance of a vertex from another one [m]."""
STRAIGHT = 1e-9
"""Sine of the angle between edges that counts as straight on."""


class Moments(NamedTuple):
    """Area and its moments about the origin."""

    area: float
    """[m2]."""
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
    a, b = edges[:, :2], edges[:, 2:]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = cross.sum() / 2
    first = (cross[:, None] * (a + b)).sum(axis=0) / 6
    ends = a + b
    outer = (
        np.einsum("n,ni,nj->ij", cross, a, a)
        + np.einsum("n,ni,nj->ij", cross, b, b)
        + np.einsum("n,ni,nj->ij", cross, ends, ends)
    ) / 24
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t = (nodes + 1) / 2
    points = a[:, None] + t[:, None] * (b - a)[:, None]
    mean_distance = np.hypot(points[..., 0], points[..., 1]) @ weights / 2
    return Moments(float(area), first, outer, float((cross * mean_distance).sum() / 3))


def polygon_edges(polygon: Polygon) -> FloatArray:
    """Return the edges ``(n, 4)`` of an oriented polygon and its holes, material on the left."""
    rings = [polygon.exterior, *polygon.interiors]
    return np.vstack([ring_edges(np.asarray(ring.coords)[:-1]) for ring in rings])


def centred(name: str, vertices: Vertices, holes: Sequence[Vertices] = ()) -> Polygon:
    """Return a checked polygon, counter-clockwise, with its centre of mass at the origin.

    A clockwise outline is turned around with a warning.

    Raises
    ------
    ValueError
        If the polygon has more than `MOST_VERTICES`, is too large, has two vertices at one place,
        crosses or touches itself, has no area, or a vertex is not finite. Fewer than 3 vertices are
        refused by `BoxSettings`.
    """
    for ring in (vertices, *holes):
        _check_ring(f"box {name!r}", ring)
    if (count := sum(map(len, (vertices, *holes)))) > MOST_VERTICES:
        raise ValueError(f"box {name!r}: {count} vertices, allowed: {MOST_VERTICES} or fewer")
    polygon = Polygon(vertices, holes)
    if not polygon.is_valid:
        raise ValueError(f"box {name!r}: not a simple polygon: {explain_validity(polygon)}")
    if not polygon.area > 1e-6 * polygon.length**2:
        raise ValueError(
            f"box {name!r}: area {polygon.area:.3g} m2 within {polygon.length:.3g} m of outline, "
            "degenerate"
        )
    if not polygon.exterior.is_ccw:
        warnings.warn(f"box {name!r}: clockwise outline turned around", stacklevel=2)
    polygon = orient(polygon)
    whole = moments(polygon_edges(polygon))
    return translate(polygon, *(-whole.first / whole.area))


def _check_ring(box: str, vertices: Vertices) -> None:
    """Refuse an outline that no body can have."""
    ring = np.asarray(vertices, dtype=float)
    if not np.isfinite(ring).all():
        raise ValueError(f"{box}: a vertex that is not finite, allowed: numbers in metres")
    # Halved before they are subtracted: the difference of two numbers may overflow.
    extent = 2 * float(np.ptp(ring / 2, axis=0).max())
    if extent > LARGEST:
        raise ValueError(f"{box}: is {extent:.3g} m long, allowed: up to {LARGEST:g} m")
    edges = np.roll(ring, -1, axis=0) - ring
    short = np.flatnonzero(np.hypot(edges[:, 0], edges[:, 1]) < LEAST_EDGE)
    if len(short):
        first, second = short[0] + 1, (short[0] + 1) % len(ring) + 1
        raise ValueError(
            f"{box}: vertices {first} and {second} are at the same place {vertices[short[0]]}, "
            "allowed: each once, the first not again at the end"
        )


def _merged(first: FloatArray, second: FloatArray) -> FloatArray | None:
    """Return the union of two convex rings that share an edge, or None unless it is convex."""
    union = shapely.union(Polygon(first), Polygon(second))
    if not isinstance(union, Polygon) or union.interiors:
        return None
    ring = np.asarray(orient(union).exterior.coords)[:-1]
    ring = ring[np.abs(_turns(ring)) > STRAIGHT]
    return ring if len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all() else None


def _turns(ring: FloatArray) -> FloatArray:
    """Return the sine of the turn at every vertex of a ring ``(n, 2)``."""
    into, out = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
    scale: FloatArray = np.linalg.norm(into, axis=1) * np.linalg.norm(out, axis=1)
    return cross / scale


def convex_pieces(polygon: Polygon) -> tuple[FloatArray, ...]:
    """Return convex counter-clockwise pieces ``(<= 8, 2)`` that together are the polygon.

    Constrained Delaunay triangles, merged greedily as long as the union of two is convex: always
    the first two in their order. What neighbours a piece is kept, so that the time grows hardly
    faster than the number of vertices.
    """
    ring = np.asarray(polygon.exterior.coords)[:-1]
    if not polygon.interiors and len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all():
        return (ring,)
    triangles = shapely.constrained_delaunay_triangles(polygon).geoms
    rings = [np.asarray(orient(t).exterior.coords)[:-1] for t in triangles if t.area > 0]
    pieces = dict(enumerate(rings))
    beside = _neighbours(rings)
    pairs = [(min(edge), max(edge)) for edge in beside.edges]
    heapify(pairs)
    while pairs:
        i, j = heappop(pairs)
        if not beside.has_edge(i, j):  # one of them has been merged since
            continue
        shared = {tuple(p) for p in pieces[i]} & {tuple(p) for p in pieces[j]}
        union = _merged(pieces[i], pieces[j]) if len(shared) >= 2 else None
        if union is None:
            continue
        pieces[i] = union
        del pieces[j]
        nx.contracted_nodes(beside, i, j, self_loops=False, copy=False)
        for other in beside[i]:
            heappush(pairs, (min(i, other), max(i, other)))
    return tuple(pieces.values())


def _neighbours(rings: Sequence[FloatArray]) -> nx.Graph:
    """Return the graph that joins rings, by index, which have an edge in common."""
    by_edge: dict[frozenset[tuple[float, ...]], list[int]] = {}
    for index, ring in enumerate(rings):
        points = [tuple(point) for point in ring.tolist()]
        for edge in zip(points, [*points[1:], points[0]], strict=True):
            by_edge.setdefault(frozenset(edge), []).append(index)
    graph = nx.empty_graph(len(rings))
    graph.add_edges_from(pair for both in by_edge.values() for pair in combinations(both, 2))
    return graph
