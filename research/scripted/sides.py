"""Where robots can push a box side by side: its sides, and for concave boxes what is in hollows.

A convex box is pushed at its sides. A concave one is pushed square to any of its edges, with robots
as far apart as their contact faces allow, be these the same edge or edges one behind the other: an
L is pushed at the end of its foot and at its back wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise, product
from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from nested_agents.boxes import BoxSpec, approach, surface

SPREAD = 0.55
"""Robots use this part of a side's half length."""
SQUARE = 0.9
"""Least cosine between the direction of pushing and the normal of a contact face."""
MARGIN = 0.35
"""Fraction of a robot's radius to either side of its center that must face the box squarely."""
GRID = 41
"""Places across a concave box that are looked at."""


class Side(NamedTuple):
    """A side of the box to push at, in the frame of the box."""

    direction: float
    """Of pushing [rad]."""
    depth: float
    """Distance of the side from the center, against `direction` [m]."""
    middle: float
    """Middle of the usable side, to the left of `direction` [m]."""
    half: float
    """Half its length [m]."""


def is_concave(box: BoxSpec) -> bool:
    """Return whether the outside of a box is concave; holes do not matter."""
    if box.polygon is None:
        return False
    outside = Polygon(box.polygon.exterior)
    return bool(outside.convex_hull.area > outside.area * (1 + 1e-9))


def behind(box: BoxSpec, direction: float, aside: float, gap: float) -> tuple[float, float]:
    """Return where a round body meets a box that it pushes.

    Parameters
    ----------
    box
        The box.
    direction, aside
        Direction of pushing [rad], and how far the body is to the left of the center [m].
    gap
        From the body's center to the surface [m].

    Returns
    -------
    back, square : float
        How far the body's center is behind that of the box [m], and the cosine between the
        direction and the inward normal of the face.
    """
    origin = -aside * sin(direction), aside * cos(direction)
    x, y = approach(box, origin, direction + pi, gap)
    _, nx, ny = surface(box.shape, x, y)
    return hypot(x - origin[0], y - origin[1]), -(nx * cos(direction) + ny * sin(direction))


def sides_of(box: BoxSpec, robots: int, span: float) -> list[Side]:
    """Return the sides of a box; none for a disc, pushed anywhere.

    Parameters
    ----------
    box
        The box.
    robots
        How many push side by side.
    span
        Radius of a robot and its clearance [m].
    """
    if box.polygon is None:
        return []
    hull = list(_edges(box.polygon.convex_hull))
    longest = max(side.half for side in hull)
    solid = [side for side in hull if side.half > 0.5 * longest]
    if robots == 1 or not is_concave(box):
        return solid  # one robot steers by where it pushes, and needs a whole side
    directions = {round(side.direction, 9): side for side in _edges(Polygon(box.polygon.exterior))}
    sides = [_stand(box, direction, robots, span) for direction in directions]
    return [side for side in sides if side is not None] or solid


def _edges(polygon: Polygon) -> Iterator[Side]:
    """Yield the edges of a polygon as sides."""
    for a, b in pairwise(np.asarray(orient(polygon).exterior.coords)):
        along = b - a
        direction = atan2(along[0], -along[1])  # inwards, left of the edge
        left = np.array([-sin(direction), cos(direction)])
        ends = sorted((a @ left, b @ left))
        depth = -float(a @ np.array([cos(direction), sin(direction)]))
        yield Side(direction, depth, sum(ends) / 2, (ends[1] - ends[0]) / 2)


def _stand(box: BoxSpec, direction: float, robots: int, span: float) -> Side | None:
    """Return where robots push a concave box in a direction: far apart, around the center."""
    ends = box.shape.edges[:, :2] @ np.array([-sin(direction), cos(direction)])
    low, high = float(ends.min()), float(ends.max())
    places = np.linspace(low, high, GRID)
    square = np.array([behind(box, direction, float(y), span)[1] > SQUARE for y in places])
    width = round(MARGIN * span / (places[1] - places[0]))
    square = np.array([square[max(i - width, 0) : i + width + 1].all() for i in range(GRID)]) & (
        np.minimum(places - low, high - places) >= MARGIN * span
    )
    least = (robots - 1) * span
    best, stand = -np.inf, None
    for middle, spread in product(places, np.linspace(least, max(least, (high - low) / 2), 9)):
        stands = middle + spread * np.linspace(-1, 1, robots)
        nearest = np.abs(places[:, None] - stands).argmin(axis=0)
        off = abs(float(middle))
        if square[nearest].all() and off < 0.5 * spread and spread - 2 * off > best:
            best, stand = spread - 2 * off, (float(middle), float(spread))
    return None if stand is None else Side(direction, -low, stand[0], stand[1] / SPREAD)
