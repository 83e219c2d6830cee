"""Boxes that robots push over the ground.

A box is a polygon, see `polygons`, or a disc. The frame of a box has its center of mass at the
origin and its back, where robots start in the easier start distributions, towards -x. Its weight
rests on the ground as a distributed friction, represented by four points, so that sliding and
turning share one friction budget as they do for a real box. A further box is one table in
``boxes.toml``; a spec may also describe one by its vertices.

Units are those of the caller as long as they are consistent.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import pi, sqrt
from pathlib import Path

import numpy as np
from shapely.affinity import translate
from shapely.geometry import Point, Polygon

from ....core.numerics import FloatArray
from ....core.plugins.models import tuples
from ....core.plugins.words import closest
from .geometry import BoxShape
from .polygons import (
    LEAST_PIECE,
    Moments,
    Vertices,
    box2d_area,
    checked_polygon,
    convex_pieces,
    moments,
    nearby_origin,
    polygon_edges,
)
from .settings import GRAVITY, BoxSettings

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
    """Outline [m]; the frame of the box is centered afterwards."""
    holes: tuple[Vertices, ...] = ()
    """Outlines of holes [m]."""
    radius: float = 0.0
    """Radius of a disc [m]; 0 for a polygon."""
    center_of_mass: tuple[float, float] | None = None
    """Center of mass of a polygon in the coordinates of its vertices [m]; None for its centroid.
    Mass and ground friction are distributed around it as in a uniform box around its centroid."""
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
    def _centered(self) -> tuple[Polygon, FloatArray]:
        """The polygon around its centroid, and the center of mass ``(2,)`` in its frame."""
        origin = nearby_origin(self.name, self.vertices)
        outline, *holes = [
            [(x - origin[0], y - origin[1]) for x, y in ring]
            for ring in (self.vertices, *self.holes)
        ]
        polygon = checked_polygon(self.name, outline, holes)
        centroid = np.array(polygon.centroid.coords[0])
        center = np.zeros(2)
        if self.center_of_mass is not None:
            center = self.center_of_mass - origin - centroid
        if not polygon.convex_hull.contains(Point(centroid + center)):
            raise ValueError(
                f"box {self.name!r}: center_of_mass = {self.center_of_mass}, must be within its "
                "outline, or the box would tip over"
            )
        return translate(polygon, *-centroid), center

    @cached_property
    def polygon(self) -> Polygon | None:
        """The polygon in the frame of the box; None for a disc."""
        if not self.vertices:
            return None
        polygon, center = self._centered
        return translate(polygon, *-center)

    @cached_property
    def rings(self) -> list[FloatArray]:
        """The closed outline ``(k, 2)`` in the frame of the box [m], then its holes."""
        if self.polygon is None:
            angles = np.linspace(0, 2 * pi, 65)
            return [self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)]
        return [np.array(ring.coords) for ring in (self.polygon.exterior, *self.polygon.interiors)]

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
        """Moments of the area about its centroid."""
        if self.polygon is None:
            area = pi * self.radius**2
            quarter = pi * self.radius**4 / 4
            return area, quarter * np.eye(2), area * self.radius * 2 / 3
        return moments(polygon_edges(self._centered[0]))

    @property
    def area(self) -> float:
        """Area [m2]."""
        return self.moments[0]

    @property
    def inertia(self) -> float:
        """Moment of inertia about the center of mass [kg m2]."""
        return float(self.mass * np.trace(self.moments[1]) / self.area)

    @cached_property
    def reach(self) -> float:
        """Distance from the center within which all of the box lies [m]."""
        return float(np.linalg.norm(np.vstack(self.rings), axis=1).max())

    @property
    def friction_force(self) -> float:
        """Ground friction of the sliding box [N]."""
        return self.friction * self.mass * GRAVITY

    @property
    def friction_radius(self) -> float:
        """Mean distance of the area from the center [m].

        Ground friction resists pure turning with `friction_force` times this lever.
        """
        return self.moments[2] / self.area

    @cached_property
    def shape(self) -> BoxShape:
        """Outline and friction radius, for kernels."""
        edges = np.zeros((1, 4)) if self.polygon is None else polygon_edges(self.polygon)
        return BoxShape(edges, self.radius, self.friction_radius)

    @cached_property
    def friction_points(self) -> FloatArray:
        """Four points ``(4, 2)`` that rub on the ground with a quarter of `friction_force` each.

        At the corners of a rectangle with the axes and the proportions of the ellipse of inertia,
        scaled such that the greatest friction torque is that of evenly spread friction.
        """
        spread, axes = np.linalg.eigh(self.moments[1] / self.area)
        half = np.sqrt(spread) * self.friction_radius / sqrt(spread.sum())
        corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) * half
        return corners @ axes.T

    @cached_property
    def width(self) -> tuple[float, float]:
        """Minimum and maximum y of the box [m]."""
        ys = np.vstack(self.rings)[:, 1]
        return float(ys.min()), float(ys.max())

    def scaled(self, factor: float) -> BoxSpec:
        """Return the box with mass and lengths, or those that grow, multiplied by `factor`."""
        along = 1.0 if self.grows == "width" else factor
        x0, y0 = self.vertices[0] if self.vertices else (0.0, 0.0)
        center: Vertices = () if self.center_of_mass is None else (self.center_of_mass,)
        vertices, center, *holes = [
            tuple((along * (x - x0), factor * (y - y0)) for x, y in points)
            for points in (self.vertices, center, *self.holes)
        ]
        return replace(
            self,
            vertices=vertices,
            holes=tuple(holes),
            center_of_mass=center[0] if center else None,
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


_TABLES = tuples(tomllib.loads(Path(__file__).with_name("boxes.toml").read_text(encoding="utf-8")))

BOXES = {name: BoxSpec(name, **table) for name, table in _TABLES.items()}
"""Boxes by the name that specs use; every one has the area of the square."""
