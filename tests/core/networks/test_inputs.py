"""Inputs of networks against hand-worked numbers."""

import numpy as np
import pytest

from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.networks.inputs import MAX_INPUT, InputEncoder


class Two(Scenario):
    """Two agents of one group, whose own variable is a speed, and who share a periodic one."""

    agents = ("a", "b")
    groups = ((0, 1),)
    action_set = ActionSet()
    state_space = StateSpace(
        "two", (Variable("speed", "1", -2, 2), Variable("way", "rad", 0, 2, periodic=True)), 1
    )

    def reset(self, seed, episode=0):
        return np.zeros((2, 2))

    def step(self, joint):
        return Transition(np.zeros((2, 2)), 0.0, False, False, {})


STATES = np.array([[1.0, 0.5], [-100.0, 0.5]])


def test_inputs_by_hand():
    encoder = InputEncoder(Two())
    own = encoder.own(STATES)
    expected = [[0.5, 1, 0, 1, 0], [-MAX_INPUT, 1, 0, 0, 1]]
    assert own == pytest.approx(np.array(expected), abs=1e-7)
    assert encoder.own_names == ["speed value", "way value", "way cosine", "is a", "is b"]
    assert encoder.joint(own) == pytest.approx([0.5, -MAX_INPUT, 1, 0], abs=1e-7)
    names = ["a: speed value", "b: speed value", "a: way value", "a: way cosine"]
    assert encoder.joint_names == names


def test_agents_without_numbers():
    encoder = InputEncoder(Two(), numbered=False)
    assert encoder.own_names == ["speed value", "way value", "way cosine"]
    assert encoder.joint(encoder.own(STATES)) == pytest.approx([0.5, -MAX_INPUT, 1, 0], abs=1e-7)


def test_environments_are_encoded_like_one():
    encoder = InputEncoder(Two())
    states = np.random.default_rng(0).normal(size=(3, 2, 2))
    together = encoder.own(states)
    assert np.array_equal(together, np.stack([encoder.own(own) for own in states]))
    alone = np.stack([encoder.joint(own) for own in together])
    assert np.array_equal(encoder.joint(together), alone)
