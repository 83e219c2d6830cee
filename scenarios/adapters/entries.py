"""Numbers of which a player's observation consists: their names, bounds and values."""

from __future__ import annotations

from collections import Counter

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from gymnasium.spaces.utils import flatdim, flatten, flatten_space

from ...core.numerics import FloatArray
from .simulators import Player, Space, describe, when

MAX_BOUND = 1e6
"""A space's bound beyond this is taken as infinite."""


class ObservationEntries:
    """The numbers of a player's observations.

    The numbers of a Dict are named after its keys; its discrete parts are one-hot encoded.

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
        self._name = describe("observation", player)
        self._parts: dict[str, Space] = dict(space.spaces) if isinstance(space, Dict) else {}
        self._space = space
        self.is_discrete = isinstance(space, Discrete)
        self.names: list[str] = []
        for key, part in (self._parts or {"o": space}).items():
            self._check_part(key, part)
            count = 1 if self.is_discrete else flatdim(part)
            is_single = count == 1 and bool(self._parts)
            self.names += [key] if is_single else [f"{key}{i}" for i in range(count)]
        for name, count in Counter(self.names).items():
            if count > 1:
                raise ValueError(f"{self._name}: {count} numbers are named {name}, rename a key")
        flat = flatten_space(space)
        if isinstance(space, Discrete):
            limits = np.array([[space.start], [space.start + space.n - 1]], float)
        elif isinstance(flat, Box):
            limits = np.array([flat.low, flat.high], float)
        self.bounds: FloatArray = np.where(
            np.abs(limits) > MAX_BOUND, np.copysign(np.inf, limits), limits
        )

    def _check_part(self, key: str, part: Space) -> None:
        if key == "action_mask":
            raise ValueError(
                f"{self._name}: action_mask, allowed: environments without action masks; wrap "
                "yours so that an illegal action does something legal"
            )
        if not isinstance(part, Box | Discrete | MultiDiscrete | MultiBinary):
            raise ValueError(
                f"{self._name}: {part}, allowed: Box, Discrete, MultiDiscrete, MultiBinary, Dict"
            )
        if isinstance(part, Box) and len(part.shape) > 1 and part.dtype == np.uint8:
            raise ValueError(
                f"{self._name}: images of shape {part.shape}, allowed: vectors of numbers; many "
                "environments offer states under another id or option"
            )

    def numbers(self, observation: object, step: int) -> FloatArray:
        """Return the numbers ``(k,)`` of an observation.

        Raises
        ------
        ValueError
            If the observation does not fit its space.
        """
        place = f"{self._name} {when(step)}"
        if not self._parts:
            numbers = _flat(self._space, observation, place)
            return numbers.argmax() + self.bounds[0] if self.is_discrete else numbers
        given = observation if isinstance(observation, dict) else {}
        for key in self._parts:
            if key not in given:
                raise ValueError(f"{place}: key {key!r} is missing")
        parts = self._parts.items()
        return np.concatenate([_flat(part, given[key], f"{place}: {key}") for key, part in parts])


def _flat(part: Space, value: object, place: str) -> FloatArray:
    """Return the numbers of a part of an observation; a Box may exceed its bounds."""
    array = np.asarray(value)
    if isinstance(part, Box):
        fits = array.shape == part.shape and np.can_cast(array.dtype, part.dtype, "same_kind")
    else:
        fits = part.contains(value)
    if not fits:
        raise ValueError(f"{place}: {value!s:.60}, allowed: {part}")
    return np.asarray(flatten(part, value), dtype=np.float64)
