"""Sides to push at: those of convex boxes, contact faces of concave ones."""

from math import pi

import pytest

from nested_agents.scenarios.box_pushing.world.boxes import BOXES, BoxSpec
from research.scripted.sides import (
    SPREAD,
    SQUARE,
    behind,
    is_concave,
    sides_of,
)

SPAN = 0.043


def test_what_is_concave() -> None:
    assert [name for name, box in BOXES.items() if is_concave(box)] == [
        "L", "T", "U", "plus", "star",
    ]  # fmt: skip
    ring = ((0, 0), (0.2, 0), (0.2, 0.2), (0, 0.2))
    hole = ((0.05, 0.05), (0.15, 0.05), (0.15, 0.15), (0.05, 0.15))
    assert not is_concave(BoxSpec("frame", ring, holes=(hole,)))


def test_a_robot_behind_a_square_and_in_the_hollow_of_a_u() -> None:
    assert behind(BOXES["square"], 0.0, 0.03, SPAN) == pytest.approx((0.1 + SPAN, 1.0))
    box = BOXES["U"]  # open towards +x
    inside, square = behind(box, pi, 0.0, SPAN)
    tip, _ = behind(box, pi, 0.12, SPAN)
    assert square == pytest.approx(1.0)
    assert tip - inside == pytest.approx(2 * (0.04 / 8) ** 0.5)  # two units of length


def test_convex_boxes_have_their_sides() -> None:
    assert len(sides_of(BOXES["square"], 2, SPAN)) == 4
    assert len(sides_of(BOXES["bar"], 2, SPAN)) == 2
    assert len(sides_of(BOXES["hexagon"], 2, SPAN)) == 6
    assert sides_of(BOXES["circle"], 2, SPAN) == []


@pytest.mark.parametrize("robots", [2, 4])
@pytest.mark.parametrize("name", ["L", "T", "U", "plus"])
def test_robots_meet_faces_of_concave_boxes_squarely(name: str, robots: int) -> None:
    box = BOXES[name].scaled(robots / 2)
    sides = sides_of(box, robots, SPAN)
    assert len(sides) == 4
    for side in sides:
        spread = SPREAD * side.half
        assert 2 * spread >= (robots - 1) * 2 * SPAN * 0.999
        for place in (-1, 1):
            _, square = behind(box, side.direction, side.middle + place * spread, SPAN)
            assert square > SQUARE


def test_a_star_is_pushed_at_its_edges_or_if_there_is_no_room_at_its_points() -> None:
    assert len(sides_of(BOXES["star"], 2, SPAN)) == 10
    assert len(sides_of(BOXES["star"].scaled(2.0), 4, SPAN)) == 5


def test_one_robot_takes_the_sides_of_the_hull() -> None:
    assert len(sides_of(BOXES["L"], 1, SPAN)) == 3
