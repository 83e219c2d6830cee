"""Sizes that are surely wrong, with the unit in which they were probably given.

The world is one of robots that stand on a table: centimetres and hundreds of grams. A box of 300 m
is no error, for the physics holds, but it was hardly intended.
"""

from collections.abc import Iterator
from math import pi
from typing import Any

LARGEST_BOX, LARGEST_RADIUS, LARGEST_REACH = 20.0, 1.0, 5.0
"""Beyond these a size was hardly intended [m]."""
HEAVIEST = 50.0
"""The same of masses [kg]."""
FASTEST = 10.0
"""The same of wheel speeds [m/s]."""
NEAREST_GOAL = 1e-4
"""A tolerance below this is hardly intended [m]."""


def warnings(settings: Any) -> Iterator[str]:
    """Yield a line for every size of `BoxTaskSettings` that is probably given in another unit."""
    box, robot = settings.box, settings.robot
    if not isinstance(box, str):
        width = max(max(axis) - min(axis) for axis in zip(*box.vertices, strict=True))
        yield from _length("box.vertices", width, LARGEST_BOX)
    if not isinstance(robot, str):
        yield from _length("robot.radius", robot.radius, LARGEST_RADIUS)
        if robot.max_speed > FASTEST:
            yield _suggest_unit("robot.max_speed", robot.max_speed, "m/s", "mm/s", 1e-3)
    for name, body in (("box", box), ("robot", robot)):
        if not isinstance(body, str) and body.mass > HEAVIEST:
            yield _suggest_unit(f"{name}.mass", body.mass, "kg", "g", 1e-3)
    yield from _length("infrared.reach", settings.infrared.reach, LARGEST_REACH)
    yield from _length("tolerance", settings.tolerance, LARGEST_BOX)
    if settings.tolerance < NEAREST_GOAL:
        problem = f"{settings.tolerance:g} m: hardly any episode will reach the goal"
        yield f"scenario.tolerance = {problem}"
    if settings.orientation_tolerance is not None and settings.orientation_tolerance > pi:
        angle = settings.orientation_tolerance
        yield _suggest_unit("orientation_tolerance", angle, "rad", "degrees", pi / 180.0)


def _length(key: str, value: float, most: float) -> Iterator[str]:
    if value > most:
        unit, factor = ("mm", 1e-3) if value * 1e-2 > most / 10.0 else ("cm", 1e-2)
        yield _suggest_unit(key, value, "m", unit, factor)


def _suggest_unit(key: str, value: float, unit: str, other: str, factor: float) -> str:
    problem = f"{value:g} {unit}: perhaps meant in {other}, {value * factor:.3g} {unit}"
    return f"scenario.{key} = {problem}"
