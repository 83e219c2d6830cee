"""Wheel forces: the kernel against its reference, the friction circle, exactness under load."""

import numpy as np
import pytest
from world_oracles import wheel_wrenches_numpy

from nested_agents.scenarios.box_pushing.world.robots import (
    ROBOTS,
    compliance,
    nominal_effect,
    wheel_model,
    wheel_wrenches,
)

DT = 0.016


def test_kernel_equals_its_reference() -> None:
    rng = np.random.default_rng(3)
    robots = [ROBOTS[name] for name in ("e-puck", "three-wheel", "four-wheel", "six-wheel")]
    n = sum(len(robot.wheels) for robot in robots)
    model = wheel_model(robots, DT, rng.choice([0.0, 0.3, 1.0], n), length=10.0)
    last, out = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    other_last, other_out = last.copy(), out.copy()
    for _ in range(50):
        motion, speeds = rng.normal(size=(4, 4)), rng.uniform(-1.3, 1.3, n)
        wheel_wrenches(motion, speeds, DT, model, last, out)
        wheel_wrenches_numpy(motion, speeds, DT, model, other_last, other_out)
        np.testing.assert_allclose(out, other_out, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(last, motion[:, 1:])


@pytest.mark.parametrize("name", ROBOTS)
def test_traction_is_limited(name: str) -> None:
    robot = ROBOTS[name]
    n = len(robot.wheels)
    out = np.zeros((1, 3))
    model = wheel_model([robot], DT, np.ones(n))
    motion = np.array([[0.0, 1.0, 2.0, 0.0]])  # sliding at 2 m/s
    wheel_wrenches(motion, np.zeros(n), DT, model, motion[:, 1:].copy(), out)
    assert np.hypot(*out[0, :2]) == pytest.approx(n * robot.wheel_limit)
    assert (out[0, :2] < 0).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_steady_motion_under_load_is_that_of_the_compliance(name: str) -> None:
    # Integrate the free body by hand with a steady load; the twist must settle at the static one.
    robot = ROBOTS[name]
    n = len(robot.wheels)
    speeds = np.full(n, 0.1)
    model = wheel_model([robot], DT, np.ones(n))
    load = np.array([-0.3, 0.0, 0.0])
    twist, last, out = np.zeros(3), np.zeros((1, 3)), np.zeros((1, 3))
    for _ in range(100):
        wheel_wrenches(np.array([[0.0, *twist]]), speeds, DT, model, last, out)
        twist = twist + DT * (out[0] + load) / model.mass[0]
    expected = nominal_effect(robot) @ [*speeds, 1.0] + compliance(robot) @ load
    np.testing.assert_allclose(twist, expected, atol=1e-6)


def test_a_free_wheel_does_not_drive() -> None:
    robot = ROBOTS["e-puck"]
    model = wheel_model([robot], DT, np.zeros(2))
    out = np.zeros((1, 3))
    wheel_wrenches(np.zeros((1, 4)), np.full(2, 0.13), DT, model, np.zeros((1, 3)), out)
    np.testing.assert_array_equal(out, 0)
