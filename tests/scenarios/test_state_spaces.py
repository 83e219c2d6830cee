"""State variables worked out by hand, and their mirror images."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.scenarios import BoxPushing, ScenarioSettings
from nested_agents.scenarios.shared_blocks import angle_of
from nested_agents.scenarios.state_spaces import STATE_SPACES, View, state_space_for, wrap

GOAL = np.array([1.0, 0.0, 0.0])


def view(robots, box, gaps) -> View:
    return View(np.array([robots], float), np.array([box], float), np.array([gaps], float), GOAL)


@pytest.mark.parametrize("name", STATE_SPACES)
def test_functions_fill_the_space_they_describe(name: str) -> None:
    spec = STATE_SPACES[name]
    poses = np.random.default_rng(0).uniform(-1, 1, (5, 2, 3))
    seen = View(poses, poses[:, 0], np.abs(poses[:, :, 0]), GOAL)
    assert spec.own(poses[:, 0], poses[:, 0, 0], GOAL).shape == (5, spec.space.n_own)
    assert spec.shared(seen, 1).shape == (5, spec.space.n_variables - spec.space.n_own)


def test_relational_variables_by_hand() -> None:
    # The box 1 m before the goal, robot 1 straight behind it, robot 2 on its left, facing it.
    situation = view([[-0.2, 0.0, 0.1], [0.0, 0.2, -pi / 2]], [0.0, 0.0, 0.3], [0.06, 0.08])
    first = STATE_SPACES["relational"].shared(situation, 0)[0]
    gap, bearing, side, others, push, turn, distance = first
    assert (gap, others, distance) == (0.06, 0.08, 1.0)
    assert bearing == pytest.approx(-0.1)
    assert side == pytest.approx(0.0)
    assert push == pytest.approx(-pi / 4)  # their middle is behind on the left, pushes to the right
    assert turn == pytest.approx(0.3)
    second = STATE_SPACES["relational"].shared(situation, 1)[0]
    assert second[1] == pytest.approx(0.0)
    assert second[2] == pytest.approx(-pi / 2)


def test_a_single_robot_has_no_others() -> None:
    shared = STATE_SPACES["relational"].shared(view([[-0.2, 0, 0]], [0, 0, 0], [0.06]), 0)[0]
    assert shared[3] == shared[0] == 0.06


def test_equation_1_by_hand() -> None:
    own = STATE_SPACES["paper"].own(np.array([[1.0, -2.0, pi]]), np.array([0.05]), GOAL)[0]
    np.testing.assert_allclose(own, [-pi, -pi / 2, 2.0, 0.05], atol=1e-12)
    shared = STATE_SPACES["paper"].shared(view([[0, 0, 0]], [1.0, 1.0, 0.2], [0.1]), 0)[0]
    np.testing.assert_allclose(shared, [0.2, -pi / 2 - 0.2, 1.0], atol=1e-12)


def test_mirrored_worlds_have_mirrored_angles() -> None:
    rng = np.random.default_rng(2)
    robots, box = rng.uniform(-1, 1, (2, 3)), rng.uniform(-0.5, 0.5, 3)
    flip = np.array([1.0, -1.0, -1.0])
    for robot in (0, 1):
        seen = STATE_SPACES["relational"].shared(view(robots, box, [0.1, 0.2]), robot)[0]
        mirrored = STATE_SPACES["relational"].shared(
            view(robots * flip, box * flip, [0.1, 0.2]), robot
        )[0]
        np.testing.assert_allclose(mirrored, seen * [1, -1, -1, 1, -1, -1, 1], atol=1e-12)


def test_angles_wrap() -> None:
    np.testing.assert_allclose(wrap(np.array([0.0, 3 * pi, -1.5 * pi])), [0.0, -pi, 0.5 * pi])


def test_wrap_is_the_remainder_to_the_last_bit() -> None:
    angles = np.random.default_rng(0).uniform(-300, 300, 100_000)
    np.testing.assert_array_equal(wrap(angles), (angles + pi) % (2 * pi) - pi)


@pytest.mark.parametrize("name", STATE_SPACES)
def test_memberships_of_wheel_speeds_span_those_of_the_robot(name: str) -> None:
    assert state_space_for(name, 0.13) is STATE_SPACES[name]
    fast, plain = state_space_for(name, 0.39).space, STATE_SPACES[name].space
    for variable, like in zip(fast.variables, plain.variables, strict=True):
        if variable.name != "wheel_speed":
            assert variable == like
        else:
            assert (variable.low, variable.high) == pytest.approx((-0.39, 0.39))
            assert variable.centres == pytest.approx(np.multiply(3, like.centres))
            assert variable.labels == like.labels


def test_a_fast_robot_gets_them() -> None:
    wheels = [{"name": "a", "x": 0, "y": 0.02}, {"name": "b", "x": 0, "y": -0.02}]
    settings = ScenarioSettings.model_validate({"robot": {"wheels": wheels, "max_speed": 0.26}})
    scenario = BoxPushing(settings)
    assert scenario.state_space.own[0].high == pytest.approx(0.26)
    scenario.reset(0)
    ahead = np.zeros(4, dtype=int)
    states = [scenario.step(ahead).states for _ in range(3)][-1]
    assert states[:, 0].max() == 0.26
    assert (states >= scenario.bounds[:, 0]).all()
    assert (states <= scenario.bounds[:, 1]).all()


@pytest.mark.parametrize("robots", [1, 2, 5])
@pytest.mark.parametrize("name", [name for name, s in STATE_SPACES.items() if s.compiled])
def test_compiled_blocks_are_those_of_the_definition(name: str, robots: int) -> None:
    rng = np.random.default_rng(robots)
    seen = View(
        rng.normal(size=(100, robots, 3)) * [1, 1, 9], rng.normal(size=(100, 3)) * [1, 1, 9],
        rng.normal(size=(100, robots)), rng.normal(size=3),
    )  # fmt: skip
    space, wanted = STATE_SPACES[name], list(range(robots))[::-1]
    expected = np.array([space.shared(seen, r) for r in wanted])
    np.testing.assert_allclose(space.shared_of(seen, wanted), expected, rtol=0, atol=1e-12)


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_angles_are_exact_to_the_last_bits(x: float, y: float) -> None:
    assert angle_of(x, y) == pytest.approx(np.arctan2(y + 0.0, x), rel=0, abs=1e-15)
