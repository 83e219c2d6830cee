"""How one robot gets to a place by itself, and its ways around a box."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.driving import Drivers, _distinct, paths
from nested_agents.scenarios.box_pushing.prediction.twists import moved
from nested_agents.scenarios.box_pushing.world.boxes import BOXES

BOX = np.zeros(3)


def drivers(robots: int) -> Drivers:
    return Drivers(BoxPushingSettings(robots=robots).build())


def wheels_after(team: Drivers, choice: int, speeds: np.ndarray) -> np.ndarray:
    return team.next(speeds[:2][None])[0][0, choice]


def test_a_robot_sets_out_for_a_place_ahead_and_rests() -> None:
    team, speeds = drivers(1), np.zeros(2)
    poses = np.array([[-0.6, 0.0, 0.0]])
    ahead = team.drive(0, poses, BOX, speeds, np.array([-0.3, 0.0, 0.0]))
    np.testing.assert_allclose(wheels_after(team, ahead, speeds), 0.065)
    fast = np.full(2, 0.13)
    np.testing.assert_allclose(wheels_after(team, team.rest(0, fast), fast), 0.0)


def test_it_keeps_clear_of_a_robot_in_its_way_and_those_far_off_do_not_count() -> None:
    target, speeds = np.array([-0.3, 0.0, 0.0]), np.zeros(4)
    at = [-0.6, 0.0, 0.0]
    free = drivers(1).drive(0, np.array([at]), BOX, speeds[:2], target)
    far = drivers(2).drive(0, np.array([at, [-0.6, 0.9, 0.0]]), BOX, speeds, target)
    near = drivers(2).drive(0, np.array([at, [-0.52, 0.0, 0.0]]), BOX, speeds, target)
    assert far == free
    assert near != free


def test_of_wheel_speeds_that_several_actions_give_only_the_first_is_tried() -> None:
    speeds = np.array([[[0.0, 0.1], [0.1, 0.1], [0.0, 0.1]], [[0.1, 0.0], [0.0, 0.1], [0.1, 0.1]]])
    np.testing.assert_array_equal(_distinct(speeds), [[True, True, False], [True] * 3])


def test_constant_twists_lead_along_arcs() -> None:
    start = np.array([[1.0, 2.0, np.pi / 2]] * 2)
    straight, arc = moved(start, np.array([[0.1, 0, 0], [0.1, 0, 1.0]]), np.pi / 2)
    np.testing.assert_allclose(straight, [1.0, 2.0 + 0.05 * np.pi, np.pi / 2])
    # A quarter of a circle of radius 0.1 to the left.
    np.testing.assert_allclose(arc, [0.9, 2.1, np.pi], atol=1e-12)


def test_ways_lead_around_the_box() -> None:
    box = BOXES["square"]
    target = np.array([0.0, 0.3])
    poses = np.array([[0.2, 0.3, 0.0], [0.0, -0.3, 0.0], [0.0, 0.12, 0.0]])
    free, around, near = paths(poses, target, np.zeros(3), box, 0.04)
    assert free == pytest.approx(0.2)
    ring = box.reach + 0.05
    assert around == pytest.approx(np.pi * ring + 2 * (0.3 - ring))
    assert near == pytest.approx(0.18 + 20 * 0.02)  # too close to the box
