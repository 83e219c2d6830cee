import pickle
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from nested_agents.core.interface.scenario import Transition, checked_reward

AGENTS = ("first", "second")


@pytest.mark.parametrize("reward", [1, -0.5, True, np.float32(2.0), np.array([1.0, 2.0]), (1, 2)])
def test_a_reward_is_a_number_or_one_for_each_agent(reward: object) -> None:
    checked_reward(reward, AGENTS)


@pytest.mark.parametrize(
    ("reward", "complaint"),
    [
        ("1.0", "reward = '1.0', allowed: a finite number, or one for each of 2 agents"),
        (None, "reward = None"),
        (np.nan, "reward = nan"),
        (1j, "reward = 1j"),
        ([1.0, np.inf], "reward = [1.0, inf]"),
        (np.zeros(3), "reward = array([0., 0., 0.])"),
        ("x" * 99, "reward = '" + "x" * 59 + ", allowed"),
    ],
)
def test_a_reward_that_cannot_be_learned_from_is_refused(reward: object, complaint: str) -> None:
    with pytest.raises(ValueError, match=re.escape(complaint)):
        checked_reward(reward, AGENTS)


def test_twists_that_are_given_stay_as_they_are() -> None:
    bare = Transition(np.zeros((1, 1)), 0.0, False, False, {})
    assert bare.measured_twists() is None
    given = np.ones((1, 3))
    assert Transition(bare.states, 0.0, False, False, {}, twists=given).measured_twists() is given
    measured = replace(bare, twists=partial(np.full, (1, 3), 2.0))
    for copy in (replace(measured, reward=1.0), pickle.loads(pickle.dumps(measured))):
        np.testing.assert_array_equal(copy.measured_twists(), np.full((1, 3), 2.0))
