"""The reward by hand, condition by condition (Eq. 15-17)."""

from math import exp

import numpy as np
import pytest
from world_oracles import reward_numpy

from nested_agents.scenarios.box_pushing.world.reward import Task, reward
from nested_agents.scenarios.box_pushing.world.settings import RewardSettings

TASK = Task.of(RewardSettings(), tolerance=0.05, orientation_tolerance=0.25)


def one(
    distance=0.5, approach=0.02, turn=0.2, contact=(True, True), readings=(1.0, 0.9), task=TASK
) -> float:
    value = reward(
        task,
        np.array([distance]),
        np.array([approach]),
        np.array([turn]),
        np.array([contact]),
        np.array([readings]),
    )
    return float(value[0, 0])


def penalties(*readings: float) -> float:
    return sum(0.0007 * exp(-5.0 * reading) for reading in readings)


def test_condition_1_pays_nearness_less_penalties() -> None:
    expected = 0.01 * exp(-1.5 * 0.5) - penalties(1.0, 0.9) - 0.0003 * 0.2
    assert one() == pytest.approx(expected, rel=1e-12)
    assert one(turn=-0.2) == one(turn=0.2)


@pytest.mark.parametrize("approach", [0.0, -0.03, 0.0009])
def test_condition_2_a_box_that_does_not_come_nearer(approach: float) -> None:
    assert one(approach=approach) == 0.000001


def test_condition_3_all_within_range() -> None:
    readings = (0.4, 0.02)
    assert one(contact=(True, False), readings=readings) == pytest.approx(-penalties(*readings))


def test_condition_3_as_printed_adds_the_attraction() -> None:
    printed = TASK._replace(attraction_without_contact=True)
    value = one(contact=(False, False), readings=(0.1, 0.1), task=printed)
    assert value == pytest.approx(0.01 * exp(-0.75) - penalties(0.1, 0.1))


def test_conditions_4_and_5_out_of_range() -> None:
    assert one(contact=(False, False), readings=(0.3, 0.0)) == -0.0015
    assert one(contact=(False, False), readings=(0.0, 0.0)) == -0.002


def test_any_number_of_robots() -> None:
    assert one(contact=(True,), readings=(1.0,)) > one(contact=(True,) * 4, readings=(1.0,) * 4)


@pytest.mark.parametrize("contact", [(True, True), (False, True), (False, False)])
def test_the_goal_pays_whatever_the_robots_do(contact: tuple[bool, bool]) -> None:
    assert one(distance=0.05, contact=contact) == 0.01
    assert one(distance=0.05, turn=0.3, contact=contact) != 0.01
    printed = TASK._replace(pays_at_goal=False)
    assert one(distance=0.05, contact=contact, task=printed) < 0.01


def test_any_orientation_counts_unless_one_is_asked_for() -> None:
    task = Task.of(RewardSettings(), 0.05, None)
    assert one(distance=0.05, turn=3.0, task=task) == 0.01


def test_of_robots_the_conditions_hold_for_each_by_itself() -> None:
    task = TASK._replace(by_robot=True)
    found = reward(
        task, np.array([0.5]), np.array([0.02]), np.array([0.2]),
        np.array([[True, False, False]]), np.array([[1.0, 0.4, 0.0]]),
    )  # fmt: skip
    first = 0.01 * exp(-1.5 * 0.5) - penalties(1.0) - 0.0003 * 0.2
    np.testing.assert_allclose(found, [[first, -penalties(0.4), -0.002]], rtol=1e-12)


@pytest.mark.parametrize("robots", [1, 2, 3, 9, 64])
@pytest.mark.parametrize("of", ["team", "robot"])
@pytest.mark.parametrize("as_printed", [False, True])
def test_it_follows_the_conditions_one_by_one(robots: int, of: str, as_printed: bool) -> None:
    rng = np.random.default_rng(robots)
    task = TASK._replace(
        by_robot=of == "robot", attraction_without_contact=as_printed, pays_at_goal=not as_printed
    )
    for m in (1, 40):
        shares = rng.choice([0.0, 0.2, 0.9, 1.0], size=(2, m, 1))
        contact = rng.random((m, robots)) < shares[0]
        readings = np.where(rng.random((m, robots)) < shares[1], rng.random((m, robots)), 0.0)
        situations = (
            rng.choice([0.04, 0.5, 0.9], size=m), rng.normal(size=m) * 0.01,
            rng.normal(size=m), contact, readings,
        )  # fmt: skip
        expected = reward_numpy(task, *situations)
        np.testing.assert_allclose(reward(task, *situations), expected, rtol=1e-12)
