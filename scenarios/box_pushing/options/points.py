"""Pushing points: where a robot may stand to push a box, computed from the outline of the box.

This is how box pushing is made easy by those who assign one agent to a robot (Wang and de Silva
2006): where to push is given, and what remains to be learned is which point to push at. The points
are numbered by where they are on the outline. What is learned of a point is learned of its number,
and means something else where the outline is another.
"""

from math import atan2

import numpy as np
from shapely.geometry import Point, Polygon
from shapely.geometry.polygon import orient

from ....core.numerics.arrays import FloatArray
from ..world.boxes import BoxSpec
from ..world.geometry import surface

ARC = 64
"""Corners of a quarter of a circle."""


def pushing_points(box: BoxSpec, count: int, gap: float) -> FloatArray:
    """Return poses ``(count, 3)`` around a box from which it can be pushed, in its frame.

    They lie at equal distances on the curve that a round body follows on its way around the box,
    counter-clockwise. The first is half such a distance past the place straight ahead of the box.

    Parameters
    ----------
    box
        The box.
    count
        How many.
    gap
        From the centre of the body to the surface of the box [m].

    Examples
    --------
    Four points around a square of 20 cm lie off its corners, eight have two to a side:

    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> pushing_points(BOXES["square"], 8, 0.05).round(2)[1:3].tolist()
    [[0.07, 0.15, -1.57], [-0.07, 0.15, -1.57]]
    """
    radius = box.outline.rounding
    solid = Point(0, 0).buffer(radius, ARC) if box.polygon is None else box.polygon
    around = orient(Polygon(Polygon(solid.exterior).buffer(gap, ARC).exterior)).exterior
    first = around.project(Point(4.0 * (box.reach + gap), 0.0))
    poses = np.empty((count, 3))
    for k in range(count):
        place = around.interpolate((first + (k + 0.5) / count * around.length) % around.length)
        _, nx, ny, _, _ = surface(box.outline.edges, radius, place.x, place.y)
        poses[k] = place.x, place.y, atan2(-ny, -nx)
    return poses
