"""Numbers of observations: names, bounds, and what does not fit a space."""

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete

from nested_agents.scenarios.adapters.entries import ObservationEntries


def test_parts_of_a_dict_stand_in_its_order() -> None:
    parts = {
        "flags": MultiBinary(2), "odds": MultiDiscrete([2, 3], start=[0, 5]), "x": Box(0, 9, (1,))
    }  # fmt: skip
    entries = ObservationEntries("a", Dict(parts))
    assert entries.names == ["flags0", "flags1", "odds0", "odds1", "odds2", "odds3", "odds4", "x"]
    seen = {"x": np.array([2.5]), "odds": np.array([1, 5]), "flags": np.array([0, 1])}
    assert entries.numbers(seen, 0).tolist() == [0, 1, 0, 1, 1, 0, 0, 2.5]


def test_a_choice_is_a_number() -> None:
    entries = ObservationEntries("a", Discrete(3, start=5))
    assert entries.bounds.tolist() == [[5.0], [7.0]]
    for seen in (6, np.int64(6), np.array(6), np.array([6])):
        assert entries.numbers(seen, 0).tolist() == [6.0]


def test_bounds_beyond_a_million_are_none() -> None:
    low, high = np.array([[0.0, -3e38], [3e38, 1.0]], dtype=np.float32)
    entries = ObservationEntries("a", Box(low, high))
    assert entries.bounds.tolist() == [[0.0, -np.inf], [np.inf, 1.0]]


@pytest.mark.parametrize(
    ("space", "seen", "message"),
    [
        (Dict({"side": Discrete(2)}), {"side": -1}, r"side: \[-1\], allowed: Discrete"),
        (Dict({"side": Discrete(2)}), {"side": 2}, r"side: \[2\], allowed: Discrete"),
        (Dict({"side": Discrete(2)}), {}, "key 'side' is missing"),
        (Dict({"side": Discrete(2)}), np.zeros(2), "key 'side' is missing"),
        (MultiDiscrete([2, 2]), [0, 2], r"\[0, 2\], allowed: MultiDiscrete"),
        (Box(-1, 1, (2,), np.int8), [0.5, 0.0], r"\[0\.5, 0\.0\], allowed: Box"),
        (Box(0, 9, (2,), np.uint8), [-1, 0], r"\[-1, 0\], allowed: Box"),
        (Box(0.0, 1.0, (2,)), {"x": 1}, "allowed: numbers"),
        (Box(0.0, 1.0, (2,)), np.zeros(3), "at step 7: 3 numbers, allowed: Box"),
        (Discrete(3), np.zeros(2), "allowed: Discrete"),
    ],
)
def test_what_does_not_fit_its_space_is_refused(space: Any, seen: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as refused:
        ObservationEntries("a", space).numbers(seen, 7)
    assert "at step 7" in str(refused.value)


def test_two_numbers_of_one_name_are_refused() -> None:
    space = Dict({"a": Box(0.0, 1.0, (2,)), "a0": Box(0.0, 1.0, (1,))})
    with pytest.raises(ValueError, match="of b: 2 numbers are named a0, rename a key"):
        ObservationEntries("b", space)
