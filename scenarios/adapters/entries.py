"""The numbers that a player observes: how they are called, between which bounds they lie.

An observation is a list of numbers in the order of its space. Those of a Dict have names by its
keys; those of discrete parts are 1 for the value observed and 0 for the others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from gymnasium.spaces.utils import flatten_space

from ...core.numerics import FloatArray
from .simulators import MASKS, Player, Space, at, masked, of_player

MOST_BOUND = 1e6
"""A bound of a space beyond it is none."""


class ObservedEntries:
    """The numbers that a player observes.

    Parameters
    ----------
    player
        Who observes.
    space
        Of its observations.

    Attributes
    ----------
    names
        Of the numbers, in order.
    bounds
        ``(2, k)`` of the numbers, infinite where there are none.

    Raises
    ------
    ValueError
        If these are images or no numbers, two have one name, or say which actions are legal; one
        line.

    Examples
    --------
    >>> entries = ObservedEntries("a", Dict({"height": Box(0.0, 9.0, (1,)), "side": Discrete(2)}))
    >>> entries.names, entries.bounds[1].tolist()
    (['height', 'side0', 'side1'], [9.0, 1.0, 1.0])
    >>> entries.numbers({"side": 1, "height": np.array([4.5])}, 0).tolist()
    [4.5, 0.0, 1.0]
    """

    def __init__(self, player: Player, space: Space) -> None:
        self.player = player
        self.space = space
        self._of = of_player("observations", player)
        self.keys = tuple(space) if isinstance(space, Dict) else ()
        """Of a Dict, in its order."""
        for part in space.values() if isinstance(space, Dict) else (space,):
            _check_part(part, self._of)
        for key in MASKS:
            if key in self.keys:
                raise masked(player, f"observations have {key}")
        self.names = self._names()
        repeated = [name for name, count in Counter(self.names).items() if count > 1]
        if repeated:
            raise ValueError(f"{self._of}: two numbers are called {repeated[0]}, rename a key")
        self.bounds = self._bounds()

    def numbers(self, observed: object, step: int) -> FloatArray:
        """Return the numbers ``(k,)`` of an observation at some step.

        Raises
        ------
        ValueError
            If it does not fit the space; one line.
        """
        where = f"{self._of} {at(step)}"
        if isinstance(self.space, Discrete):
            numbers = _discrete(observed, where)
        elif isinstance(self.space, Dict):
            numbers = np.concatenate(
                [
                    _flat(part, _entry(observed, key, where), f"{where}: {key}")
                    for key, part in self.space.items()
                ]
            )
        else:
            numbers = _flat(self.space, observed, where)
        if len(numbers) != len(self.names):
            raise ValueError(f"observed are {len(numbers)} numbers, of {self.space}, {at(step)}")
        return numbers

    def _names(self) -> list[str]:
        if isinstance(self.space, Discrete):
            return ["o0"]
        if not isinstance(self.space, Dict):
            return [f"o{i}" for i in range(_count(self.space))]
        names = []
        for key, part in self.space.items():
            count = _count(part)
            names += [str(key)] if count == 1 else [f"{key}{i}" for i in range(count)]
        return names

    def _bounds(self) -> FloatArray:
        if isinstance(self.space, Discrete):
            first = self.space.start
            return np.array([[first], [first + self.space.n - 1]], dtype=np.float64)
        flat = flatten_space(self.space)
        assert isinstance(flat, Box)
        ends = np.array([flat.low, flat.high], dtype=np.float64)
        return np.where(np.abs(ends) > MOST_BOUND, np.copysign(np.inf, ends), ends)


def _check_part(part: Space, of: str) -> None:
    """Refuse what is no fixed number of numbers."""
    if not isinstance(part, Box | Discrete | MultiDiscrete | MultiBinary):
        raise ValueError(f"{of}: {part}, allowed: a fixed number of numbers")
    if isinstance(part, Box) and len(part.shape) > 1 and part.dtype == np.uint8:
        raise ValueError(
            f"{of}: images of shape {part.shape}, allowed: numbers; many environments have "
            "another id or option whose observations are states"
        )


def _count(part: Space) -> int:
    """Return of how many numbers a part of an observation consists."""
    flat = flatten_space(part)
    assert isinstance(flat, Box)
    return int(flat.shape[0])


def _entry(observed: object, key: str, where: str) -> object:
    """Return what a table that is observed has under a key."""
    if not isinstance(observed, Mapping) or key not in observed:
        raise ValueError(f"{where}: there is no {key!r}, which their space has")
    return observed[key]


def _discrete(observed: object, where: str) -> FloatArray:
    """Return the one number of a discrete observation."""
    number = np.asarray(observed)
    if number.size != 1 or number.dtype.kind not in "biuf":
        raise ValueError(f"{where}: {observed!r:.40}, allowed: one number")
    return np.array(number, dtype=np.float64).reshape(1)


def _flat(part: Space, observed: object, where: str) -> FloatArray:
    """Return the numbers of what is observed of a part of a space, in its type."""
    values = np.asarray(observed)
    if values.dtype.kind not in "biuf":
        raise ValueError(f"{where}: {observed!r:.40}, allowed: numbers")
    if isinstance(part, Discrete | MultiDiscrete):
        first = np.ravel(part.start)
        counts = np.ravel(part.n if isinstance(part, Discrete) else part.nvec)
        values = values.ravel()
        is_inside = values.size == counts.size and (values >= first) & (values < first + counts)
        if not np.all(is_inside):
            raise ValueError(f"{where}: {values.tolist()} is outside of {part}")
        places = np.cumsum(counts) - counts + (values - first)
        return np.isin(np.arange(counts.sum()), places).astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        typed = values.astype(part.dtype)
    if typed.dtype.kind in "biu" and not np.array_equal(typed, values):
        raise ValueError(f"{where}: {values.ravel().tolist()} are no numbers of {part}")
    return np.array(typed, dtype=np.float64).ravel()
