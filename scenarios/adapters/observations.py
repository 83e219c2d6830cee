"""State variables of a foreign environment: numbers of what its players observe."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any, NamedTuple, cast

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from gymnasium.spaces.utils import flatten, flatten_space

from ...core.interface.spaces import Variable
from ...core.numerics.arrays import FloatArray
from .settings import AdaptedSettings, Direction

MOST_BOUND = 1e6
"""A bound of a space beyond it is none."""
MOST_CENTRES = 32
"""Values of a discrete observation that each have a membership function of their own, at most."""


class Numbers(NamedTuple):
    """The numbers of an observation."""

    names: tuple[str, ...]
    low: FloatArray
    """Bounds ``(k,)``, infinite where there are none."""
    high: FloatArray


def numbers_of(player: str, space: Any) -> Numbers:
    """Return the numbers that a player observes.

    Raises
    ------
    ValueError
        If these are images or no numbers; one line.
    """
    of = f" of {player}" if player else ""
    for part in space.values() if isinstance(space, Dict) else [space]:
        if isinstance(part, Box) and len(part.shape) > 1 and part.dtype == np.uint8:
            raise ValueError(
                f"observations{of}: images of shape {part.shape}, allowed: numbers; many "
                "environments have another id or option whose observations are states"
            )
    if isinstance(space, Discrete):
        first, last = float(space.start), float(space.start + space.n - 1)
        return Numbers(("o0",), np.array([first]), np.array([last]))
    parts = list(space.values()) if isinstance(space, Dict) else [space]
    if not all(isinstance(part, Box | Discrete | MultiDiscrete | MultiBinary) for part in parts):
        raise ValueError(f"observations{of}: {space}, allowed: a fixed number of numbers")
    flat = cast(Box, flatten_space(space))
    names = tuple(f"o{i}" for i in range(len(flat.low)))
    if isinstance(space, Dict):
        sizes = {key: len(cast(Box, flatten_space(part)).low) for key, part in space.items()}
        names = tuple(
            key if size == 1 else f"{key}{i}" for key, size in sizes.items() for i in range(size)
        )
    low: FloatArray = np.array(flat.low, dtype=np.float64)
    high: FloatArray = np.array(flat.high, dtype=np.float64)
    low[low < -MOST_BOUND], high[high > MOST_BOUND] = -np.inf, np.inf
    return Numbers(names, low, high)


class Perception:
    """What the agents of a foreign environment perceive.

    Parameters
    ----------
    settings
        Which numbers are state variables, and their ranges.
    spaces
        Of the players' observations.
    bodies
        The player of every body.
    met
        Returns the least and greatest numbers ``(k,)`` of random episodes, given what makes them of
        observations.

    Attributes
    ----------
    variables
        The state variables.
    common
        Names of those that are the same for all.

    Raises
    ------
    ValueError
        If the settings name what is not there, or a range is not known; one line.
    """

    def __init__(
        self,
        settings: AdaptedSettings,
        spaces: Mapping[str, Any],
        bodies: Sequence[str],
        met: Callable[[Any], tuple[FloatArray, FloatArray]],
    ) -> None:
        self._spaces, self._bodies = spaces, bodies
        every = [numbers_of(player, space) for player, space in spaces.items()]
        self._numbers = every[0]
        chosen: dict[str, Any] = {**settings.variables, **settings.angles}
        has_all = not settings.variables
        if len({numbers.names for numbers in every}) > 1:
            if has_all:
                raise ValueError(
                    "scenario.variables: players observe differently many numbers, "
                    "say which are variables"
                )
            self._numbers = min(every, key=lambda numbers: len(numbers.names))
        # Where each variable is in what each body observes: one row, of angles cosine and sine two.
        self._places = {name: self._find(name, entries) for name, entries in chosen.items()}
        if has_all:
            used = {int(i) for places in self._places.values() for i in places.ravel()}
            left = (i for i in range(len(self._numbers.names)) if i not in used)
            rest = {self._numbers.names[i]: np.full((1, len(bodies)), i) for i in left}
            self._places = {**rest, **self._places}
        for key, given in (("ranges", settings.ranges), ("success", settings.success)):
            for name in given:
                if name not in self._places and (key, name) != ("success", "return"):
                    known = ", ".join(self._places)
                    raise ValueError(f"scenario.{key}.{name}: no state variable, known: {known}")
        self._angles = set(settings.angles)
        self.variables = tuple(self._described(settings, cache(partial(met, self.flat)), has_all))
        if not self.variables:
            raise ValueError("observations: none of their numbers changes in random episodes")
        self._places = {variable.name: self._places[variable.name] for variable in self.variables}
        is_one = len(spaces) == 1
        self.common = tuple(
            name for name, places in self._places.items()
            if is_one and (places == places[:, :1]).all()
        )  # fmt: skip

    def _find(self, name: str, entries: Any) -> Any:
        """Return where a variable is: ``(1, bodies)``, ``(2, bodies)`` of cosine and sine."""
        if isinstance(entries, Direction):
            return np.concatenate([self._find(name, entries.cos), self._find(name, entries.sin)])
        names, n = self._numbers.names, len(self._bodies)
        listed = entries if isinstance(entries, tuple) else (entries,) * n
        if len(listed) != n:
            raise ValueError(f"scenario: variable {name!r} has {len(listed)} places of {n} bodies")
        places = [names.index(e) if isinstance(e, str) and e in names else e for e in listed]
        for place in places:
            if isinstance(place, str) or not 0 <= place < len(names):
                raise ValueError(
                    f"scenario: variable {name!r} is {place!r} of an observation, allowed 0 to "
                    f"{len(names) - 1}, or {', '.join(names)}"
                )
        return np.array([places], dtype=np.int64)

    def _described(
        self, settings: AdaptedSettings, met: Callable[[], Any], has_all: bool
    ) -> Iterator[Variable]:
        """Yield the variables; of all that there are, those that change."""
        low, high = self._numbers.low, self._numbers.high
        is_one = len(self._spaces) == 1
        discrete = is_one and isinstance(next(iter(self._spaces.values())), Discrete)
        for name, places in self._places.items():
            if name in self._angles:
                yield Variable(name, "rad", -np.pi, np.pi, periodic=True)
                continue
            ends = low[places].min(), high[places].max()
            if name in settings.ranges:
                ends = settings.ranges[name]
            elif not np.isfinite(ends).all():
                least, greatest = met()
                ends = least[places].min(), greatest[places].max()
                if ends[0] == ends[1] and has_all:
                    continue
            if ends[0] == ends[1]:
                raise ValueError(
                    f"scenario.variables.{name}: the environment gives it no bounds, and in "
                    f"random episodes it is always {ends[0]:g}; give scenario.ranges.{name}"
                )
            values = np.arange(ends[0], ends[1] + 1.0) if discrete else np.zeros(0)
            centres = tuple(values.tolist()) if len(values) <= MOST_CENTRES else ()
            yield Variable(name, "1", float(ends[0]), float(ends[1]), centres=centres)

    def flat(self, observations: Mapping[str, Any]) -> FloatArray:
        """Return the numbers ``(players, k)`` of what players observe."""
        count, flattened = len(self._numbers.names), cast(Any, flatten)
        return np.array(
            [
                [observations[player]]
                if isinstance(space, Discrete)
                else flattened(space, observations[player])[:count]
                for player, space in self._spaces.items()
            ],
            dtype=np.float64,
        )

    def states(self, observations: Mapping[str, Any]) -> FloatArray:
        """Return the states ``(bodies, d)`` of every body."""
        flat, players = self.flat(observations), list(self._spaces)
        states = np.empty((len(self._bodies), len(self._places)))
        for b, player in enumerate(self._bodies):
            for j, (name, places) in enumerate(self._places.items()):
                numbers = flat[players.index(player), places[:, b]]
                if name not in self._angles:
                    states[b, j] = numbers[0]
                elif len(numbers) == 2:
                    states[b, j] = np.arctan2(numbers[1], numbers[0])
                else:
                    states[b, j] = (numbers[0] + np.pi) % (2.0 * np.pi) - np.pi
        return states
