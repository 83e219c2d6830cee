"""Numbers of which a player's observation consists: their names, bounds and values.

The numbers of a Dict are named after its keys. Discrete parts of a Dict are one-hot encoded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from gymnasium.spaces.utils import flatdim, flatten, flatten_space

from ...core.numerics import FloatArray
from ..library_types import Space
from .simulators import MASK_KEYS, Player, describe, mask_error, when

MAX_BOUND = 1e6
"""A space's bound beyond this is taken as infinite."""


class ObservationEntries:
    """The numbers of a player's observations.

    Attributes
    ----------
    names
        Names of the ``k`` numbers, in order.
    bounds
        ``(2, k)`` lower and upper bounds, infinite where the space has none.

    Raises
    ------
    ValueError
        If the space contains images, text or sequences, has an action mask, or two numbers have
        the same name.

    Examples
    --------
    >>> space = Dict({"height": Box(0.0, 9.0, (1,)), "side": Discrete(2)})
    >>> entries = ObservationEntries("a", space)
    >>> entries.names, entries.bounds[1].tolist()
    (['height', 'side0', 'side1'], [9.0, 1.0, 1.0])
    >>> entries.numbers({"side": 1, "height": np.array([4.5])}, 0).tolist()
    [4.5, 0.0, 1.0]
    """

    def __init__(self, player: Player, space: Space) -> None:
        self.player = player
        self.space = space
        self._name = describe("observation", player)
        self._parts = dict(space.spaces) if isinstance(space, Dict) else {"o": space}
        self.names: list[str] = []
        for key, part in self._parts.items():
            if key in MASK_KEYS:
                raise mask_error(player, f"observation has {key}")
            _check_part(part, self._name)
            count = 1 if part is space and isinstance(part, Discrete) else flatdim(part)
            is_single = count == 1 and part is not space
            self.names += [str(key)] if is_single else [f"{key}{i}" for i in range(count)]
        for name, count in Counter(self.names).items():
            if count > 1:
                raise ValueError(f"{self._name}: {count} numbers are named {name}, rename a key")
        self.bounds = self._bounds()

    def _bounds(self) -> FloatArray:
        if isinstance(self.space, Discrete):
            first = float(self.space.start)
            return np.array([[first], [first + float(self.space.n) - 1]])
        flat: Any = flatten_space(self.space)
        bounds = np.array([flat.low, flat.high], dtype=np.float64)
        return np.where(np.abs(bounds) > MAX_BOUND, np.copysign(np.inf, bounds), bounds)

    def numbers(self, observation: object, step: int) -> FloatArray:
        """Return the numbers ``(k,)`` of an observation.

        Raises
        ------
        ValueError
            If the observation does not fit its space.
        """
        name = f"{self._name} {when(step)}"
        is_dict = isinstance(self.space, Dict)
        values = observation if is_dict else {"o": observation}
        parts = []
        for key, part in self._parts.items():
            if not isinstance(values, Mapping) or key not in values:
                raise ValueError(f"{name}: key {key!r} is missing")
            parts.append(_flat(part, values[key], f"{name}: {key}" if is_dict else name))
        numbers = np.concatenate(parts)
        if isinstance(self.space, Discrete):
            numbers = np.atleast_1d(numbers.argmax() + self.bounds[0])
        if len(numbers) != len(self.names):
            raise ValueError(f"{name}: {len(numbers)} numbers, allowed: {self.space}")
        return numbers


def _check_part(part: Space, name: str) -> None:
    """Refuse spaces that are not a fixed number of numbers, and images."""
    if not isinstance(part, Box | Discrete | MultiDiscrete | MultiBinary):
        raise ValueError(
            f"{name}: {part}, allowed: Box, Discrete, MultiDiscrete, MultiBinary, Dict"
        )
    if isinstance(part, Box) and len(part.shape) > 1 and part.dtype == np.uint8:
        raise ValueError(
            f"{name}: images of shape {part.shape}, allowed: vectors of numbers; many environments "
            "offer states under another id or option"
        )


def _flat(part: Space, value: object, name: str) -> FloatArray:
    """Return the numbers of a part of an observation; discrete parts are one-hot encoded."""
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name}: {value!r:.40}, allowed: numbers")
    with np.errstate(invalid="ignore", over="ignore"):
        typed = array.astype(part.dtype)
    if typed.dtype.kind in "biu" and not np.array_equal(typed, array):
        raise ValueError(f"{name}: {array.ravel().tolist()}, allowed: {part}")
    if isinstance(part, Box):
        return typed.ravel().astype(np.float64)
    if isinstance(part, Discrete) and typed.size == 1:
        typed = typed.reshape(())
    if not part.contains(typed):
        raise ValueError(f"{name}: {typed.ravel().tolist()}, allowed: {part}")
    return np.asarray(flatten(part, typed), dtype=np.float64)
