"""Agents: how they are called, and which are alike."""

from functools import cache

import numpy as np
import pytest
from gymnasium.spaces import Box
from made_up_environments import HugeActions, Numbered, Unnamed, Walkers

from nested_agents.scenarios.adapters.scenario import from_pettingzoo


def test_agents_are_called_by_the_ids_of_players() -> None:
    class Many(Walkers):
        ids = tuple(f"agent_{i}" for i in range(12))

    world = from_pettingzoo(Many)
    assert world.agents == Many.ids
    assert world.roles == ("agent",) * 12
    numbered = from_pettingzoo(Numbered)
    assert (numbered.agents, numbered.roles) == (("0", "1", "2"), ("player",) * 3)
    assert from_pettingzoo(Unnamed).agents == ("", "other")


class Counted(Walkers):
    """Actions are whole numbers from -3 to 3."""

    @cache  # noqa: B019 - the same space each time
    def action_space(self, agent: object) -> Box:
        return Box(-3, 3, (1,), np.int64)

    def step(self, actions: dict) -> object:
        return super().step({agent: int(action[0]) for agent, action in actions.items()})


def test_levels_of_whole_numbers_are_what_is_executed() -> None:
    actions = from_pettingzoo(Counted, actions=5).action_set.names
    assert actions == ("-3", "-2", "0", "2", "3")
    assert len(from_pettingzoo(Counted, actions=7).action_set) == 7
    with pytest.raises(ValueError, match=r"scenario\.actions = 8: .* allowed: 2 to 7"):
        from_pettingzoo(Counted, actions=8)


def test_actions_without_bounds_are_refused() -> None:
    with pytest.raises(ValueError, match="allowed: bounds within 1,000,000; wrap it in Rescale"):
        from_pettingzoo(HugeActions)
