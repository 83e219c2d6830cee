"""How many robots push together: from one side or two, by patterns and best responses."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from research.scripted.controller import (
    ScriptedController,
    decisions_to_goal,
)
from research.scripted.crowd import CONE, Crowd


def crowd_of(robots: int) -> tuple[BoxPushing, Crowd]:
    scenario = BoxPushingSettings(robots=robots).build()
    scenario.reset(0)
    found = ScriptedController(scenario)._crowd
    assert found is not None
    return scenario, found


def plan_for(robots: int, bearing: float):
    """Return the plan for robots behind a box from which the goal is in direction `bearing`."""
    scenario, crowd = crowd_of(robots)
    poses, box = scenario.measure()["robot_poses"], scenario.world.box_pose
    course = box[2] + bearing
    goal = np.array([box[0] + np.cos(course), box[1] + np.sin(course), 0.0])
    return crowd._plan(poses, box, goal)


def test_what_cannot_be_turned_in_time_is_pushed_obliquely_or_from_two_sides() -> None:
    straight, turned, beyond = plan_for(64, 0.05), plan_for(8, 0.6), plan_for(64, 0.6)
    assert straight.oblique == turned.oblique == beyond.oblique == 0.0
    assert not straight.second.any()
    assert not turned.second.any()
    # In proportion to the way that each side has to give.
    assert beyond.second.sum() == round(64 * np.sin(0.6) / (np.sin(0.6) + np.cos(0.6)))
    assert set(beyond.side[:, 0].round(6)) == {0.0, round(np.pi / 2, 6)}
    assert 0.0 < plan_for(64, 0.4).oblique <= CONE


def test_slots_of_one_side_lie_along_it_and_apart() -> None:
    scenario, crowd = crowd_of(32)
    side = crowd.sides[0]
    slots = crowd._slots(side, 32, np.zeros(3))
    apart = np.hypot(*np.diff(slots[:, :2], axis=0).T)
    assert apart.min() > 2 * scenario.robot.radius
    assert np.hypot(*slots[:, :2].T).max() < scenario.box.reach + 0.1


def test_nobody_waits_for_a_few_that_are_away() -> None:
    scenario, crowd = crowd_of(8)
    measured = scenario.measure()
    poses, goal = measured["robot_poses"].copy(), measured["goal_pose"]
    poses[3, :2] -= 0.5
    local = crowd.choose(poses, measured["box_pose"], goal, measured["wheel_speeds"])
    drivers = crowd._drivers
    ahead = [drivers.next(np.zeros((1, 2)))[0][0, k].mean() for k in local]
    assert np.count_nonzero(np.array(ahead) > 0) >= 6
    poses[:4, :2] -= 0.5
    local = crowd.choose(poses, measured["box_pose"], goal, measured["wheel_speeds"])
    assert not any(drivers.next(np.zeros((1, 2)))[0][0, local[r]].any() for r in range(4, 8))


@pytest.mark.parametrize("start", ["easy", "medium"])
@pytest.mark.parametrize("robots", [3, 8, 16])
def test_crowds_reach_the_goal(robots: int, start: str) -> None:
    scenario = BoxPushingSettings(robots=robots, start=start).build()  # type: ignore[arg-type]
    assert all(decisions_to_goal(scenario, seed, 200) is not None for seed in range(3))


# Sizes, scalings and intervals: python -m research.sizes.


@pytest.mark.slow
@pytest.mark.parametrize("robots", [32, 64])
def test_large_crowds_reach_the_goal(robots: int) -> None:
    scenario = BoxPushingSettings(robots=robots).build()
    taken = [decisions_to_goal(scenario, seed, 200) for seed in range(10000, 10003)]
    assert sum(steps is not None for steps in taken) >= 2


def test_in_units_of_the_box_it_is_as_solvable() -> None:
    scenario = BoxPushingSettings(robots=4, scaling="similar").build()
    assert decisions_to_goal(scenario, 0, 200) is not None
