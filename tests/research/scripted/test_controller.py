"""The scripted controller solves box pushing: the scenario is known to be solvable."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from research.scripted.controller import (
    ScriptedController,
    decisions_to_goal,
)


def solved(scenario: BoxPushing, seed: int) -> bool:
    """Return whether the controller brings the box to the goal within 200 decisions."""
    return decisions_to_goal(scenario, seed, 200) is not None


# The whole table, 20 seeds of every box and start, all solved: python -m research.scripted.


@pytest.mark.parametrize("start", ["easy", "medium", "hard"])
def test_two_robots_and_a_square(start: str) -> None:
    scenario = BoxPushingSettings(start=start).build()  # type: ignore[arg-type]
    assert all(solved(scenario, seed) for seed in range(6))


@pytest.mark.parametrize("box", BOXES)
def test_every_box(box: str) -> None:
    scenario = BoxPushingSettings(box=box).build()
    assert all(solved(scenario, seed) for seed in range(3))


@pytest.mark.slow
@pytest.mark.parametrize("box", BOXES)
def test_every_box_from_anywhere(box: str) -> None:
    scenario = BoxPushingSettings(box=box, start="hard").build()
    assert all(solved(scenario, seed) for seed in range(100, 105))


@pytest.mark.parametrize("robots", [1, 3, 4])
def test_other_numbers_of_robots(robots: int) -> None:
    scenario = BoxPushingSettings(robots=robots).build()
    assert np.mean([solved(scenario, seed) for seed in range(4)]) >= 0.75


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot(robot: str) -> None:
    scenario = BoxPushingSettings(robot=robot).build()
    assert np.mean([solved(scenario, seed) for seed in range(3)]) > 0.5


def test_it_remembers_nothing() -> None:
    scenario = BoxPushingSettings(start="hard").build()
    old = ScriptedController(scenario)
    scenario.reset(3)
    for _ in range(10):
        measured = scenario.measure()
        action = old.act(measured)
        fresh = ScriptedController(scenario)
        np.testing.assert_array_equal(fresh.act(measured), action)
        scenario.step(action)


def test_of_many_robots_not_every_joint_action_is_tried() -> None:
    scenario = BoxPushingSettings(robots=16, start="easy").build()
    scenario.reset(0)
    controller = ScriptedController(scenario)
    situation = scenario.measure()
    poses, box, goal = (situation[k] for k in ("robot_poses", "box_pose", "goal_pose"))
    side, slots = controller._plan(poses, box, goal)
    chosen = controller._push(poses, box, goal, situation["wheel_speeds"], side, slots)
    assert len(chosen) == 16  # 16 ** 16 overflows to 0
