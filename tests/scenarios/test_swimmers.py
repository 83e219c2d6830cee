"""Swimmers of any number of joints."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("mujoco", reason="extra mujoco")

SWIMMER = "nested_agents.scenarios.swimmers:NestedAgents/Swimmer-v0"


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
