"""Boxes, which are pushed over the ground.

Box2D takes convex polygons of at most 8 vertices and silently gets others wrong, so that any simple
polygon, concave or with holes, goes through here first: it is checked, centred on its centre of
mass and cut into convex pieces. The frame of a box has its centre of mass at the origin and its
back, where robots start in the easier start distributions, towards -x. Its weight rests on the
ground as a distributed friction, stood for by four points, so that sliding and turning share one
friction budget as they do for a real box. A further box, concave or with holes, is one `BoxSpec`
and one line in `BOXES`; a spec may also describe one by its vertices.

Units are those of the caller as long as they are consistent.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from heapq import heapify, heappop, heappush
from itertools import combinations
from math import cos, pi, sin, sqrt

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from shapely.validation import explain_validity

from ....core.numerics import FloatArray, nx
from ....core.plugins.words import closest
from .geometry import BoxShape, Moments, Outline, moments, ring_edges
from .settings import GRAVITY, BoxSettings

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


def centre(name: str, vertices: Vertices, holes: Sequence[Vertices] = ()) -> Polygon:
    """Return a checked polygon, counter-clockwise, with its centre of mass at the origin.

    A clockwise outline is turned around with a warning.

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
    polygon = translate(polygon, *-nearby_origin(vertices))
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


def _merge(first: FloatArray, second: FloatArray) -> FloatArray | None:
    """Return the union of two convex rings that share an edge, or None unless it is convex."""
    union = shapely.union(Polygon(first), Polygon(second))
    if not isinstance(union, Polygon) or union.interiors:
        return None
    ring = np.asarray(orient(union).exterior.coords)[:-1]
    ring = ring[np.abs(_turns(ring)) > STRAIGHT]
    return ring if len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all() else None


def _turns(ring: FloatArray) -> FloatArray:
    """Return the sine of the turn at every vertex of a ring ``(n, 2)``."""
    into = ring - np.roll(ring, 1, axis=0)
    out = np.roll(ring, -1, axis=0) - ring
    cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
    return cross / (np.linalg.norm(into, axis=1) * np.linalg.norm(out, axis=1))


def convex_pieces(polygon: Polygon) -> tuple[FloatArray, ...]:
    """Return convex counter-clockwise pieces ``(<= 8, 2)`` that together are the polygon.

    Constrained Delaunay triangles, merged greedily as long as the union of two is convex: always
    the first two in their order. A graph of neighbors keeps the time nearly linear in
    the number of vertices.
    """
    ring = np.asarray(polygon.exterior.coords)[:-1]
    if not polygon.interiors and len(ring) <= MAX_VERTICES and (_turns(ring) > 0).all():
        return (ring,)
    triangles = shapely.constrained_delaunay_triangles(polygon).geoms
    rings = [np.asarray(orient(t).exterior.coords)[:-1] for t in triangles if t.area > 0]
    pieces = dict(enumerate(rings))
    graph = _neighbours(rings)
    pairs = [(min(edge), max(edge)) for edge in graph.edges]
    heapify(pairs)
    while pairs:
        i, j = heappop(pairs)
        if not graph.has_edge(i, j):  # one of the two was merged
            continue
        shared = {tuple(p) for p in pieces[i]} & {tuple(p) for p in pieces[j]}
        union = _merge(pieces[i], pieces[j]) if len(shared) >= 2 else None
        if union is None:
            continue
        pieces[i] = union
        del pieces[j]
        nx.contracted_nodes(graph, i, j, self_loops=False, copy=False)
        for other in graph[i]:
            heappush(pairs, (min(i, other), max(i, other)))
    return tuple(pieces.values())


def box2d_area(piece: FloatArray) -> float:
    """Return the area of a piece ``(n, 2)`` as Box2D computes it, in single precision [m2]."""
    x, y = (piece * UNIT).astype(np.float32).T
    return float(sum(x * np.roll(y, -1) - y * np.roll(x, -1), np.float32(0))) / 2 / UNIT**2


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


AREA = 0.04
"""Area of every named box: that of a square of 20 cm [m2]."""
ROBOTS_PER_BOX = 2
"""Number of robots for which the named boxes are made."""


@dataclass(frozen=True)
class BoxSpec:
    """A box: a polygon, or a disc if it has a radius instead of vertices.

    Raises
    ------
    ValueError
        If the outline is not a simple polygon. Quantities are checked by `BoxSettings`.

    Examples
    --------
    >>> box = BOXES["square"]
    >>> round(box.area, 12), round(box.friction_force, 3), round(box.friction_radius, 4)
    (0.04, 0.785, 0.0765)
    """

    name: str
    """Name in specs."""
    vertices: Vertices = ()
    """Outline [m], anywhere in the plane; the frame of the box is centred afterwards."""
    holes: tuple[Vertices, ...] = ()
    """Outlines of holes [m]."""
    radius: float = 0.0
    """Radius of a disc [m]; 0 for a polygon."""
    mass: float = 0.4
    """Mass [kg]."""
    friction: float = 0.2
    """Coefficient of friction with the ground."""
    contact_friction: float = 0.3
    """Coefficient of friction with robots."""
    grows: bool | str = field(default=True, compare=False)
    """Whether it grows with the number of robots, or its ``width`` alone."""

    def __post_init__(self) -> None:
        if bool(self.vertices) == bool(self.radius):
            raise ValueError(f"box {self.name!r}: needs either vertices or a radius")
        _ = self.polygon  # what cannot be one is refused at once

    @cached_property
    def polygon(self) -> Polygon | None:
        """The centred polygon; None for a disc."""
        return centre(self.name, self.vertices, self.holes) if self.vertices else None

    @cached_property
    def rings(self) -> list[FloatArray]:
        """The closed outline ``(k, 2)`` in the frame of the box [m], then its holes."""
        if self.polygon is None:
            angles = np.linspace(0, 2 * pi, 65)
            return [self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)]
        return [np.array(ring.coords) for ring in (self.polygon.exterior, *self.polygon.interiors)]

    @cached_property
    def outline(self) -> Outline:
        """The surface, in the frame of the box."""
        if self.polygon is None:
            return Outline(np.zeros((1, 4)), self.radius)
        return Outline(polygon_edges(self.polygon))

    @cached_property
    def fixtures(self) -> tuple[FloatArray, ...]:
        """Convex pieces ``(<= 8, 2)`` [m]; empty for a disc.

        Raises
        ------
        ValueError
            If one is too small to be simulated.
        """
        pieces = () if self.polygon is None else convex_pieces(self.polygon)
        smallest = min(map(box2d_area, pieces), default=LEAST_PIECE)
        if smallest < LEAST_PIECE:
            raise ValueError(
                f"box {self.name!r}: a convex piece of it has {smallest:.2g} m2, must be at least "
                f"{LEAST_PIECE:g} m2 to be simulated; fewer vertices make larger pieces"
            )
        return pieces

    @cached_property
    def moments(self) -> Moments:
        """Moments of the area."""
        if self.polygon is None:
            area = pi * self.radius**2
            quarter = pi * self.radius**4 / 4
            return Moments(area, np.zeros(2), quarter * np.eye(2), area * self.radius * 2 / 3)
        return moments(self.outline.edges)

    @property
    def area(self) -> float:
        """Area [m2]."""
        return self.moments.area

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre of mass [kg m2]."""
        return float(self.mass * np.trace(self.moments.second) / self.area)

    @cached_property
    def reach(self) -> float:
        """Distance from the centre within which all of the box lies [m]."""
        return self.outline.radius

    @property
    def friction_force(self) -> float:
        """Ground friction of the sliding box [N]."""
        return self.friction * self.mass * GRAVITY

    @property
    def friction_radius(self) -> float:
        """Mean distance of the area from the centre [m].

        Ground friction resists pure turning with `friction_force` times this lever.
        """
        return self.moments.radial / self.area

    @cached_property
    def shape(self) -> BoxShape:
        """Outline and friction radius, for kernels."""
        outline = self.outline
        return BoxShape(outline.edges, outline.rounding, self.friction_radius)

    @cached_property
    def friction_points(self) -> FloatArray:
        """Four points ``(4, 2)`` that rub on the ground with a quarter of `friction_force` each.

        At the corners of a rectangle with the axes and the proportions of the ellipse of inertia,
        scaled such that the greatest friction torque is that of evenly spread friction.
        """
        spread, axes = np.linalg.eigh(self.moments.second / self.area)
        half = np.sqrt(spread) * self.friction_radius / sqrt(spread.sum())
        corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) * half
        return corners @ axes.T

    @cached_property
    def width(self) -> tuple[float, float]:
        """Least and greatest y of the box [m]: how broad it looks from behind."""
        ends = self.outline.edges.reshape(-1, 2)[:, 1]
        return float(ends.min()) - self.outline.rounding, float(ends.max()) + self.outline.rounding

    def scaled(self, factor: float) -> BoxSpec:
        """Return the box with mass and lengths, or those that grow, multiplied by `factor`."""
        along = 1.0 if self.grows == "width" else factor
        x0, y0 = nearby_origin(self.vertices) if self.vertices else (0.0, 0.0)
        outline, *holes = [
            tuple((along * (x - x0), factor * (y - y0)) for x, y in ring)
            for ring in (self.vertices, *self.holes)
        ]
        return replace(
            self,
            vertices=outline,
            holes=tuple(holes),
            radius=along * self.radius,
            mass=factor * self.mass,
        )


def box_for(box: str | BoxSettings, robots: int) -> BoxSpec:
    """Return the box that a spec names or describes, or that `label` has written.

    Up to two robots push the box as it stands in the table. For more, its lengths and its mass
    grow in proportion to their number: each has the same room along the back and the same share
    of the friction as one of two. A box that is described grows only if it says so, and if it says
    so along its width only.

    Raises
    ------
    ValueError
        If no box has that name, or there can be none as described; one line.

    Examples
    --------
    >>> box = box_for("square", 4)
    >>> round(box.area, 12), box.mass
    (0.16, 0.8)
    """
    described = _spec_of(box)
    factor = growth(box, robots)
    return described if factor == 1.0 else described.scaled(factor)


def growth(box: str | BoxSettings, robots: int) -> float:
    """Return the size of a box relative to that for two robots; 1 if it does not grow.

    Raises
    ------
    ValueError
        As `box_for`.

    Examples
    --------
    >>> growth("square", 2), growth("square", 8)
    (1.0, 4.0)
    """
    return max(robots / ROBOTS_PER_BOX, 1.0) if _spec_of(box).grows else 1.0


def _spec_of(box: str | BoxSettings) -> BoxSpec:
    """Return a box as it stands in the table or the spec."""
    if isinstance(box, str) and box.startswith("{"):
        box = BoxSettings.model_validate_json(box)
    if isinstance(box, BoxSettings):
        return BoxSpec(**{**dict(box), "name": "own"})
    if box not in BOXES:
        raise ValueError(f"scenario.box = {box!r}: {closest(box, BOXES)}")
    return BOXES[box]


def _rectangle(name: str, depth: float, width: float) -> BoxSpec:
    x = depth / 2
    y = width / 2
    return BoxSpec(name, ((-x, -y), (x, -y), (x, y), (-x, y)))


def _regular(name: str, sides: int) -> BoxSpec:
    """Return a regular polygon of area `AREA` with a side towards -x."""
    radius = sqrt(2 * AREA / (sides * sin(2 * pi / sides)))
    angles = [pi + pi / sides + 2 * pi * i / sides for i in range(sides)]
    return BoxSpec(name, tuple((radius * cos(a), radius * sin(a)) for a in angles))


def _shape(name: str, *vertices: tuple[float, float]) -> BoxSpec:
    """Return a polygon scaled to `AREA`."""
    unit = sqrt(AREA / Polygon(vertices).area)
    return BoxSpec(name, tuple((unit * x, unit * y) for x, y in vertices))


def _star(name: str, points: int, depth: float) -> BoxSpec:
    """Return a star with a point ahead and hollows of `depth`, relative to its radius."""
    corners = [(1.0, 2 * pi * i / points) for i in range(points)]
    hollows = [(1.0 - depth, angle + pi / points) for _, angle in corners]
    ring = [corner for pair in zip(corners, hollows, strict=True) for corner in pair]
    return _shape(name, *((radius * cos(angle), radius * sin(angle)) for radius, angle in ring))


PLUS = (
    (-3, -1), (-1, -1), (-1, -3), (1, -3), (1, -1), (3, -1),
    (3, 1), (1, 1), (1, 3), (-1, 3), (-1, 1), (-3, 1),
)  # fmt: skip

BOXES: dict[str, BoxSpec] = {
    box.name: box
    for box in (
        _rectangle("square", 0.2, 0.2),
        _rectangle("rectangle", 0.16, 0.25),
        _rectangle("bar", 0.08, 0.5),
        BoxSpec("circle", radius=sqrt(AREA / pi)),
        _regular("triangle", 3),
        _regular("pentagon", 5),
        _regular("hexagon", 6),
        _shape("L", (0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)),
        _shape("T", (0, -3), (2, -3), (2, -1), (5, -1), (5, 1), (2, 1), (2, 3), (0, 3)),
        _shape("U", (0, -2), (3, -2), (3, -1), (1, -1), (1, 1), (3, 1), (3, 2), (0, 2)),
        _shape("plus", *PLUS),
        _star("star", 5, 0.5),
    )
}
"""Boxes by the name that specs use; every one has the area of the square."""
