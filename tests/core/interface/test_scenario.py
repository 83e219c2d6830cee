import re

import numpy as np
import pytest

from nested_agents.core.interface.scenario import check_reward

AGENTS = ("first", "second")


@pytest.mark.parametrize("reward", [1, -0.5, True, np.float32(2.0), np.array([1.0, 2.0]), (1, 2)])
def test_a_reward_is_a_number_or_one_for_each_agent(reward: object) -> None:
    check_reward(reward, AGENTS)


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
        check_reward(reward, AGENTS)
