"""State variables: bounds and entries of all players that they are read from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_up_environments import Huge, Keyed, Reusing, Wide, WideUnsaid

from nested_agents.scenarios.adapters.scenario import from_pettingzoo
from nested_agents.scenarios.checking.checker import ScenarioError, check_scenario


def bounds(env: Any, **keys: Any) -> list[tuple[float, float]]:
    variables = from_pettingzoo(env, **keys).state_space.variables
    return [(variable.low, variable.high) for variable in variables]


def test_bounds_are_those_of_all_players() -> None:
    assert bounds(Wide) == [(-10.0, 10.0), (-10.0, 10.0)]
    assert bounds(Wide, variables={"x": (0, 1)}) == [(-10.0, 10.0)]
    (low, high), _ = bounds(WideUnsaid)
    assert low < -1.0 < 1.0 < high


def test_a_variable_that_players_read_elsewhere_has_the_bounds_of_these_places() -> None:
    (place_or_time,) = bounds(Keyed, variables={"x": ("place", "time")})
    assert place_or_time == (-1.0, 1.0)
    (time_or_time,) = bounds(Keyed, variables={"x": "time"})
    assert time_or_time == (0.0, 1.0)


def test_entries_are_looked_up_by_key() -> None:
    world = from_pettingzoo(Keyed)
    assert [variable.name for variable in world.state_space.variables] == ["place", "time"]
    world.reset(0)
    states = world.step(np.array([1, 1])).states
    assert states[:, 1].tolist() == [pytest.approx(0.1)] * 2
    by_name = from_pettingzoo(Keyed, variables={"when": "time", "where": 0})
    by_name.reset(0)
    assert by_name.step(np.array([1, 1])).states == pytest.approx(states[:, ::-1])


def test_bounds_that_are_none_are_found_by_playing() -> None:
    (low, high), (first, last) = bounds(Huge)
    assert -1.0 <= low < high <= 1.0
    assert (first, last) == (0.0, 1.0)


def test_the_same_array_may_be_handed_out_again() -> None:
    assert check_scenario(lambda: from_pettingzoo(Reusing), steps=8).passed


def test_what_leaves_its_bounds_is_a_fault_unless_the_settings_give_a_range() -> None:
    from made_up_environments import Outside

    with pytest.raises(ScenarioError, match=r"values: o0 leaves \[-1\.\d+, 1\.\d+\] at the start"):
        check_scenario(lambda: from_pettingzoo(Outside), steps=4)
    ranges = {"o0": (-50.0, 50.0), "o1": (0.0, 50.0)}
    assert check_scenario(lambda: from_pettingzoo(Outside, ranges=ranges), steps=4).passed
