"""State variables of an environment's agents, read from the observations of its players."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics import FloatArray, IntArray, wrap
from .entries import ObservationEntries
from .settings import Direction, Entries, EnvironmentSettings
from .simulators import EnvironmentStep, Player, Space, describe, when

MAX_CENTRES = 32
"""Maximum number of values of a discrete observation that each have a membership function."""
ROUNDING = 1e-6
"""Relative amount by which a number may exceed the bounds of its space."""

Numbers = list[FloatArray]
"""Numbers of the observation of each player."""
Explore = Callable[[Callable[[EnvironmentStep], Numbers]], Numbers]
"""Plays random episodes; returns the minimum and maximum ``(2, k)`` of each player's numbers."""


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
        Called with the method `numbers` if a range is unknown.

    Attributes
    ----------
    variables
        The state variables.
    common
        Names of the variables that are the same for all bodies.
    bounds
        ``(d, 2)`` bounds of the variables according to the spaces. They are infinite where the
        spaces have none, and where the settings give a range.

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
        explore: Explore,
    ) -> None:
        self._settings = settings
        self._bodies = bodies
        self._players = list(spaces)
        self._entries = {player: ObservationEntries(player, spaces[player]) for player in spaces}
        places = self._find_places()
        explored = cache(lambda: explore(self.numbers))
        described = {name: self._variable(name, places[name], explored) for name in places}
        self.variables = tuple(variable for variable in described.values() if variable)
        names = [variable.name for variable in self.variables]
        self._check_names(names)
        # (d, bodies) place of each variable, or of the cosine and the sine of an angle
        self._first: IntArray = np.stack([places[name][0] for name in names])
        self._last: IntArray = np.stack([places[name][-1] for name in names])
        self._has_direction = np.array([len(places[name]) == 2 for name in names])
        self._is_angle = np.array([variable.periodic for variable in self.variables])
        self.bounds: FloatArray = np.array([self._bounds_of(name, places[name]) for name in names])
        is_single = len(spaces) == 1
        self.common = tuple(
            name for name in names if is_single and (places[name] == places[name][:, :1]).all()
        )

    def _find_places(self) -> dict[str, IntArray]:
        """Return the places of variables in observations ``(1 or 2, bodies)``, 2 for cos and sin.

        A place is the index of a number in the observation of the player of a body.
        """
        settings = self._settings
        first, *others = (entries.names for entries in self._entries.values())
        shared = [name for name in first if all(name in other for other in others)]
        if not settings.variables and any(set(other) != set(shared) for other in (first, *others)):
            raise ValueError(
                "scenario.variables is missing: players observe different numbers, name some"
            )
        angles = {
            name: self._find(f"angles.{name}", entries, shared)
            for name, entries in settings.angles.items()
        }
        if settings.variables:
            places = {
                name: self._find(f"variables.{name}", entries, shared)
                for name, entries in settings.variables.items()
            }
        else:
            used = {first[i] for rows in angles.values() for i in rows[:, 0]}
            free = [name for name in shared if name not in used]
            places = {name: self._find(name, name, shared) for name in free}
        for name in angles.keys() & places.keys():
            raise ValueError(f"scenario.angles.{name}: another state variable has this name")
        return places | angles

    def _find(self, key: str, entries: Entries | Direction, shared: list[str]) -> IntArray:
        if isinstance(entries, Direction):
            parts = [self._find(key, part, shared) for part in (entries.cos, entries.sin)]
            return np.concatenate(parts)
        by_body = entries if isinstance(entries, tuple) else (entries,) * len(self._bodies)
        known: list[str | int] = [*range(len(shared)), *shared]
        if len(by_body) != len(self._bodies) or not set(by_body) <= set(known):
            raise ValueError(
                f"scenario.{key} = {entries}, allowed: a number of the observation, 0 to "
                f"{len(shared) - 1} or {', '.join(shared)}, or one for each of "
                f"{len(self._bodies)} bodies"
            )
        names = [shared[entry] if isinstance(entry, int) else entry for entry in by_body]
        pairs = zip(self._bodies, names, strict=True)
        return np.array([[self._entries[player].names.index(name) for player, name in pairs]])

    def _variable(
        self, name: str, places: IntArray, explored: Callable[[], Numbers]
    ) -> Variable | None:
        """Return a state variable; None for an unnamed number that never changes."""
        settings = self._settings
        centres = settings.centres.get(name, ())
        if name in settings.angles:
            return Variable(name, "rad", -np.pi, np.pi, periodic=True, centres=centres)
        bounds = [entries.bounds for entries in self._entries.values()]
        low, high = settings.ranges.get(name) or self._range(bounds, places)
        if not np.isfinite([low, high]).all():
            low, high = self._range(explored(), places)
        if low < high:
            is_discrete = all(entries.is_discrete for entries in self._entries.values())
            if is_discrete and not centres and high - low < MAX_CENTRES:
                centres = tuple(np.arange(low, high + 1.0).tolist())
            return Variable(name, "1", low, high, centres=centres)
        if settings.variables:
            raise ValueError(
                f"scenario.variables.{name}: has no bounds and is always {low:g} in random "
                f"episodes; set scenario.ranges.{name}"
            )
        return None

    def _range(self, bounds: Numbers, places: IntArray) -> tuple[float, float]:
        """Return the range of a variable over all bodies, from bounds ``(2, k)`` by player."""
        pairs = zip(self._bodies, places[0], strict=True)
        ends = [bounds[self._players.index(player)][:, place] for player, place in pairs]
        return float(np.min(ends)), float(np.max(ends))

    def _bounds_of(self, name: str, places: IntArray) -> tuple[float, float]:
        if name in self._settings.angles:
            return -np.pi, np.pi
        if name in self._settings.ranges:
            return -np.inf, np.inf
        low, high = self._range([entries.bounds for entries in self._entries.values()], places)
        margin = ROUNDING * max(abs(end) for end in (low, high, 1.0) if np.isfinite(end))
        return low - margin, high + margin

    def _check_names(self, names: Sequence[str]) -> None:
        if not names:
            raise ValueError("observation: all of its numbers are constant in random episodes")
        settings = self._settings
        success = settings.success if isinstance(settings.success, dict) else {}
        used = {
            "ranges": set(settings.ranges),
            "centres": set(settings.centres),
            "success": set(success) - {"return"},
        }
        for key, given in used.items():
            for name in sorted(given.difference(names)):
                raise ValueError(
                    f"scenario.{key}.{name}: no such state variable, known: {', '.join(names)}"
                )

    def numbers(self, step: EnvironmentStep) -> Numbers:
        """Return the numbers of the observation of each player.

        Raises
        ------
        ValueError
            If an observation does not fit its space.
        """
        return [
            entries.numbers(step.observations[player], step.step)
            for player, entries in self._entries.items()
        ]

    def states(self, step: EnvironmentStep) -> FloatArray:
        """Return the states ``(bodies, d)`` of all bodies.

        Raises
        ------
        ValueError
            If an observation does not fit its space, or a state variable is not finite.
        """
        numbers = dict(zip(self._players, self.numbers(step), strict=True))
        own = [numbers[player] for player in self._bodies]
        first = np.stack([row[self._first[:, body]] for body, row in enumerate(own)])
        last = np.stack([row[self._last[:, body]] for body, row in enumerate(own)])
        angles = np.where(self._has_direction, np.arctan2(last, first), wrap(first))
        states: FloatArray = np.where(self._is_angle, angles, first)
        for body, i in np.argwhere(~np.isfinite(states)):
            raise ValueError(
                f"{describe('observation', self._bodies[body])} {when(step.step)}: "
                f"{self.variables[i].name} = {states[body, i]}, allowed: finite numbers"
            )
        return states
