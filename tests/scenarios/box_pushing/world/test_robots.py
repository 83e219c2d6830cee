"""Robots: kinematics, compliance, refusals."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.world.robots import (
    ROBOTS,
    compliance,
    nominal_effect,
    robot_for,
)
from nested_agents.scenarios.box_pushing.world.settings import RobotSettings, WheelSettings


def test_two_wheels_are_a_differential_drive() -> None:
    left, right = 0.02, 0.05
    twist = nominal_effect(ROBOTS["e-puck"]) @ [left, right, 1.0]
    np.testing.assert_allclose(twist, [(left + right) / 2, 0.0, (right - left) / 0.053], atol=1e-15)


def test_a_skid_steer_turns_as_if_its_axle_were_longer() -> None:
    robot = ROBOTS["four-wheel"]
    turn = nominal_effect(robot) @ [-0.05, 0.05, -0.05, 0.05, 1.0]
    factor = 0.1 / 0.053 / turn[2]
    ratio = (0.018 / 0.0265) ** 2 * robot.lateral_stiffness / robot.stiffness
    assert factor == pytest.approx(1 + ratio)
    assert factor == pytest.approx(1.46, abs=0.01)


def test_one_seized_wheel_of_four_halves_the_speed_straight_ahead() -> None:
    # The other side must run at half speed for the torques to balance.
    twist = nominal_effect(ROBOTS["four-wheel"]) @ [0.13, 0.065, 0.0, 0.065, 1.0]
    np.testing.assert_allclose(twist, [0.065, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot(name: str) -> None:
    robot = ROBOTS[name]
    assert robot.name == name
    effect = nominal_effect(robot)
    assert effect.shape == (3, len(robot.wheels) + 1)
    straight = effect @ np.append(np.full(len(robot.wheels), 0.1), 1.0)
    np.testing.assert_allclose(straight, [0.1, 0.0, 0.0], atol=1e-15)
    yielding = compliance(robot)
    np.testing.assert_allclose(yielding, yielding.T)
    assert (np.linalg.eigvalsh(yielding) > 0).all()
    # Half the box load costs 3 cm/s, and is within traction.
    assert yielding[0, 0] * 0.3924 == pytest.approx(0.03, rel=0.02)
    assert len(robot.wheels) * robot.wheel_limit > 0.785


def wheel(name: str, x: float, y: float) -> WheelSettings:
    return WheelSettings(name=name, x=x, y=y)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"radius": 0.0}, "radius = 0.0"),
        ({"mass": float("nan")}, "mass"),
        ({"wheels": ()}, "at least 1"),
        ({"wheels": (wheel("a", 0, 0.02), wheel("a", 0, -0.02))}, "different names"),
        ({"wheels": (wheel("a", 0, 0.05), wheel("b", 0, -0.02))}, "within the body"),
        ({"wheels": (wheel("a", 0, 0.02),)}, "cannot resist turning"),
        ({"sensors": (float("inf"),)}, "sensors"),
    ],
)
def test_bad_robots_are_refused(change: dict[str, object], word: str) -> None:
    with pytest.raises(ValueError, match=word) as error:
        robot_for(RobotSettings(**dict(ROBOTS["e-puck"]) | change))
    assert "\n" not in str(error.value)
