"""Agents: how they are called, and which are alike."""

import pytest
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


def test_actions_without_bounds_are_refused() -> None:
    with pytest.raises(ValueError, match="allowed: bounds within 1,000,000; wrap it in Rescale"):
        from_pettingzoo(HugeActions)
