"""Pushing points: where they are, and that robots push from there."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import PushingPointsSettings
from nested_agents.scenarios.box_pushing.pushing_points import pushing_points
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.geometry import surface

GAP = 0.05


@pytest.mark.parametrize("box", BOXES.values(), ids=BOXES)
def test_points_are_as_far_from_the_box_as_is_said_and_face_it(box) -> None:
    points = pushing_points(box, 8, GAP)
    for x, y, direction in points:
        gap, nx, ny, _, _ = surface(box.outline.edges, box.outline.rounding, x, y)
        assert gap == pytest.approx(GAP, abs=1e-3)  # arcs have corners
        assert np.cos(direction) * nx + np.sin(direction) * ny == pytest.approx(-1.0)
    assert len({(round(x, 6), round(y, 6)) for x, y, _ in points}) == 8


def test_a_square_has_two_points_to_a_side() -> None:
    directions = pushing_points(BOXES["square"], 8, GAP)[:, 2]
    _, counts = np.unique((directions / (np.pi / 2)).round(9) % 4, return_counts=True)
    assert counts.tolist() == [2, 2, 2, 2]


def test_the_same_number_means_another_direction_on_another_box() -> None:
    """What the paper holds against actions that depend on the geometry of the object (X-B)."""
    square, star = (pushing_points(BOXES[name], 8, GAP)[:, 2] for name in ("square", "star"))
    turned = np.abs((star - square + np.pi) % (2 * np.pi) - np.pi)
    assert np.degrees(turned).max() > 45


def test_robots_behind_the_box_push_it_straight_to_the_goal() -> None:
    scenario = PushingPointsSettings(start="easy").build()
    scenario.reset(2)
    rewards, least = [], scenario.measure()["distance_m"] - scenario.settings.tolerance
    for _ in range(12):
        transition = scenario.step(np.array([3, 4]))  # the two points at the back
        rewards.append(transition.reward)
        if transition.terminated:
            break
    assert rewards[-1] == scenario.settings.goal_reward
    assert 0 < sum(rewards[:-1]) < least  # it came nearer by so much
