"""State variables of an environment's agents, read from the observations of its players."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from gymnasium.spaces import Discrete

from ...core.interface.spaces import Variable
from ...core.numerics import BoolArray, FloatArray, IntArray, wrap
from ..library_types import Space
from .entries import ObservationEntries
from .settings import Direction, Entries, EnvironmentSettings
from .simulators import EnvironmentStep, Player, describe, when

MAX_CENTRES = 32
"""Maximum number of values of a discrete observation that each have a membership function."""
ROUNDING = 1e-6
"""Relative amount by which a number may exceed the bounds of its space."""


class StateReader:
    """Reads the state variables of every body from the observations of the players.

    Parameters
    ----------
    settings
        State variables and their ranges.
    spaces
        Observation spaces by player.
    bodies
        Player of each body.
    explore
        Returns the minimum and maximum ``(players, 2, k)`` of the numbers in random episodes, given
        the function that reads these numbers. Called if a range is unknown.

    Attributes
    ----------
    variables
        The state variables.
    common
        Names of the variables that are the same for all bodies.

    Raises
    ------
    ValueError
        If the settings name an unknown variable or number, players observe different numbers, or a
        range is unknown.
    """

    def __init__(
        self,
        settings: EnvironmentSettings,
        spaces: Mapping[Player, Space],
        bodies: Sequence[Player],
        explore: Callable[[Callable[[EnvironmentStep], FloatArray]], FloatArray],
    ) -> None:
        self._settings = settings
        self._entries = [ObservationEntries(player, space) for player, space in spaces.items()]
        self._player: IntArray = np.array([list(spaces).index(player) for player in bodies])
        self._names = self._common_names()
        # Column of each common number in the observation of each player.
        self._columns = [[own.names.index(n) for n in self._names] for own in self._entries]
        columns = zip(self._entries, self._columns, strict=True)
        self._bounds: FloatArray = np.stack([own.bounds[:, places] for own, places in columns])
        self._places = self._find_variables()
        self._is_read: BoolArray = np.zeros((len(spaces), len(self._names)), dtype=bool)
        for rows in self._places.values():
            self._is_read[self._player, rows] = True
        explored = cache(lambda: explore(self.numbers))
        described = (self._variable(name, explored) for name in self._places)
        self.variables = tuple(variable for variable in described if variable is not None)
        names = [variable.name for variable in self.variables]
        self._check_names(names)
        if not self.variables:
            raise ValueError("observation: all of its numbers are constant in random episodes")
        self.common: tuple[str, ...] = ()
        if len(spaces) == 1:
            places = [(name, self._places[name]) for name in names]
            self.common = tuple(name for name, at in places if (at == at[:, :1]).all())

    def _common_names(self) -> list[str]:
        """Return the names of the numbers that all players observe, in the order of the first."""
        first, *others = self._entries
        shared = set(first.names).intersection(*(other.names for other in others))
        if not self._settings.variables and any(set(e.names) != shared for e in self._entries):
            raise ValueError(
                "scenario.variables is missing: players observe different numbers, name some"
            )
        return [name for name in first.names if name in shared]

    def _find_variables(self) -> dict[str, IntArray]:
        """Return the columns of each variable ``(1, bodies)``; ``(2, bodies)`` for cos and sin."""
        settings = self._settings
        angles = {name: self._find(f"angles.{name}", e) for name, e in settings.angles.items()}
        used = {int(i) for rows in angles.values() for i in rows.ravel()}
        named = settings.variables or {
            name: i for i, name in enumerate(self._names) if i not in used
        }
        places = {name: self._find(f"variables.{name}", entry) for name, entry in named.items()}
        for name in angles.keys() & places.keys():
            raise ValueError(f"scenario.angles.{name}: another state variable has this name")
        return places | angles

    def _find(self, key: str, entries: Entries | Direction) -> IntArray:
        if isinstance(entries, Direction):
            return np.concatenate([self._find(key, entries.cos), self._find(key, entries.sin)])
        n = len(self._player)
        count = len(self._names)
        by_body = entries if isinstance(entries, tuple) else (entries,) * n
        known: list[str | int] = [*self._names, *range(count)]
        if len(by_body) != n or not set(by_body) <= set(known):
            raise ValueError(
                f"scenario.{key} = {entries}, allowed: a number of the observation, 0 to "
                f"{count - 1} or {', '.join(self._names)}, or one for each of {n} bodies"
            )
        return np.array([[known.index(entry) % count for entry in by_body]], dtype=np.int64)

    def _variable(self, name: str, explored: Callable[[], FloatArray]) -> Variable | None:
        """Return a state variable; None for an unnamed number that never changes."""
        settings = self._settings
        centers = settings.centers.get(name, ())
        if name in settings.angles:
            return Variable(name, "rad", -np.pi, np.pi, periodic=True, centers=centers)
        low, high = settings.ranges.get(name) or self._range(self._bounds, name)
        if not np.isfinite([low, high]).all():
            low, high = self._range(explored(), name)
        if low < high:
            is_discrete = all(isinstance(own.space, Discrete) for own in self._entries)
            if is_discrete and not centers and high - low < MAX_CENTRES:
                centers = tuple(np.arange(low, high + 1.0).tolist())
            return Variable(name, "1", low, high, centers=centers, bounds=self._bounds_of(name))
        if settings.variables:
            raise ValueError(
                f"scenario.variables.{name}: has no bounds and is always {low:g} in random "
                f"episodes; set scenario.ranges.{name}"
            )
        return None

    def _range(self, bounds: FloatArray, name: str) -> tuple[float, float]:
        """Return the bounds ``(players, 2, k)`` of a variable over all bodies."""
        rows = self._places[name]
        low, high = (bounds[self._player, end, rows] for end in (0, 1))
        return float(low.min()), float(high.max())

    def _bounds_of(self, name: str) -> tuple[float, float]:
        """Return the bounds by the spaces; infinite if the settings give a range."""
        if name in self._settings.ranges:
            return -np.inf, np.inf
        low, high = self._range(self._bounds, name)
        margin = ROUNDING * max(abs(end) for end in (low, high, 1.0) if np.isfinite(end))
        return low - margin, high + margin

    def _check_names(self, names: Sequence[str]) -> None:
        for key in ("ranges", "centers", "success"):
            table = dict(self._settings)[key]
            for name in table if isinstance(table, dict) else ():
                if name not in names and (key, name) != ("success", "return"):
                    known = ", ".join(names)
                    raise ValueError(
                        f"scenario.{key}.{name}: no such state variable, known: {known}"
                    )

    def numbers(self, step: EnvironmentStep) -> FloatArray:
        """Return the common numbers ``(players, k)`` of the observations.

        Raises
        ------
        ValueError
            If an observation does not fit its space, or a number that is used is not finite.
        """
        rows = []
        for own, columns in zip(self._entries, self._columns, strict=True):
            rows.append(own.numbers(step.observations[own.player], step.step)[columns])
        numbers: FloatArray = np.array(rows)
        for player, column in np.argwhere(self._is_read & ~np.isfinite(numbers)):
            name = describe("observation", self._entries[player].player)
            raise ValueError(
                f"{name} {when(step.step)}: {self._names[column]} = {numbers[player, column]}, "
                "allowed: finite numbers"
            )
        return numbers

    def states(self, step: EnvironmentStep) -> FloatArray:
        """Return the states ``(bodies, d)`` of all bodies."""
        numbers = self.numbers(step)[self._player]
        bodies = np.arange(len(numbers))
        states = []
        for variable in self.variables:
            first, *second = numbers[bodies, self._places[variable.name]]
            if second:
                states.append(np.arctan2(second[0], first))
            else:
                states.append(wrap(first) if variable.periodic else first)
        return np.stack(states, axis=1)
