"""Swimmers of any number of joints."""

import gymnasium
import numpy as np
import pytest

from nested_agents.scenarios import SCENARIOS

pytest.importorskip("mujoco", reason="extra mujoco")

SWIMMER = "nested_agents_swimmers:NestedAgents/Swimmer-v0"


def test_the_swimmer_of_two_joints_is_that_of_gymnasium() -> None:
    worlds = gymnasium.make(SWIMMER), gymnasium.make("Swimmer-v5")
    assert np.array_equal(*(world.reset(seed=3)[0] for world in worlds))
    rng = np.random.default_rng(0)
    for _ in range(50):
        torques = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
        (ours, reward, *_), (theirs, expected, *_) = (world.step(torques) for world in worlds)
        assert np.array_equal(ours, theirs)
        assert reward == expected


@pytest.mark.parametrize("joints", [4, 32])
def test_further_joints_have_torques_and_are_observed(joints: int) -> None:
    world = gymnasium.make(SWIMMER, joints=joints)
    assert world.action_space.shape == (joints,)
    assert world.observation_space.shape == (2 * joints + 4,)  # an angle more, three speeds
    names = [world.unwrapped.model.joint(k).name for k in range(3, joints + 3)]
    assert names == [f"joint{k}" for k in range(1, joints + 1)]
    world.reset(seed=0)
    still = world.step(np.zeros(joints, np.float32))[0]
    world.reset(seed=0)
    turned = np.eye(joints, dtype=np.float32)[-1]
    assert abs(world.step(turned)[0] - still).argmax() == 2 * joints + 3  # the last joint's speed


def test_joints_of_the_example_see_those_next_to_them() -> None:
    world = SCENARIOS.parsed("swimmer", joints=3).build()
    assert world.agents == ("body1.1", "body2.1", "body3.1")
    env = world._simulator.env.unwrapped  # the pose is set by hand
    turned = np.array([0.1, 0.2, 0.3])
    env.set_state(np.r_[0, 0, 0, turned], np.r_[0.5, 0, 0, 10 * turned])
    seen = world.states_of({"": env._get_obs()})
    assert np.allclose(seen[:, 0], turned)
    assert np.allclose(seen[:, 1:3], [[0.2, 0.2], [0.1, 0.3], [0.2, 0.2]])
    assert np.allclose(seen[:, 3], 10 * turned)
    assert np.allclose(seen[:, 4:], [0.0, 0.5])
