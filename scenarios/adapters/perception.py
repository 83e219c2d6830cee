"""What the agents of a foreign environment perceive: numbers of what players observe."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from itertools import compress

import numpy as np
from gymnasium.spaces import Discrete

from ...core.interface.spaces import Variable
from ...core.numerics import BoolArray, FloatArray, IntArray, wrap
from .entries import ObservedEntries
from .settings import AdaptedSettings, Direction, Entries
from .simulators import Played, Player, Space, at, of_player

Numbers = Callable[[Played], FloatArray]
"""Returns the numbers ``(players, k)`` of what players observe."""
MOST_CENTRES = 32
"""Values of a discrete observation that each have a membership function of their own, at most."""
ROUNDING = 1e-6
"""By how much a number may leave the bounds of its space, relative to them."""


class Perception:
    """What the agents of a foreign environment perceive.

    Entries are looked up by name in what each player observes, so that the order in which players
    have them does not matter.

    Parameters
    ----------
    settings
        Which numbers are state variables, and their ranges.
    spaces
        Of the players' observations.
    bodies
        The player of every body.
    met
        Returns the least and greatest numbers ``(players, 2, k)`` of random episodes, given what
        makes them of observations.

    Attributes
    ----------
    variables
        The state variables.
    common
        Names of those that are the same for all.
    bounds
        ``(d, 2)`` between which variables lie, as spaces say; infinite where they say nothing, or
        the settings give another range.

    Raises
    ------
    ValueError
        If the settings name what is not there, players observe different entries, or a range is
        not known; one line.
    """

    def __init__(
        self,
        settings: AdaptedSettings,
        spaces: Mapping[Player, Space],
        bodies: Sequence[Player],
        met: Callable[[Numbers], FloatArray],
    ) -> None:
        self._settings = settings
        self._entries = [ObservedEntries(player, space) for player, space in spaces.items()]
        self._players: IntArray = np.array([list(spaces).index(player) for player in bodies])
        self._names = self._common_names()
        # Where each player has them that all have.
        self._columns = [[own.names.index(n) for n in self._names] for own in self._entries]
        self._bounds: FloatArray = np.stack(
            [
                own.bounds[:, columns]
                for own, columns in zip(self._entries, self._columns, strict=True)
            ]
        )
        self._places = self._find_variables()
        self._is_read: BoolArray = np.zeros((len(spaces), len(self._names)), dtype=bool)
        for rows in self._places.values():
            self._is_read[self._players, rows] = True
        self.variables = tuple(self._describe(cache(partial(met, self.numbers))))
        names = [variable.name for variable in self.variables]
        self._check_known(names)
        if not self.variables:
            raise ValueError("observations: none of their numbers changes in random episodes")
        kept = [self._places[name] for name in names]
        self._first: IntArray = np.stack([rows[0] for rows in kept], axis=1)
        self._last: IntArray = np.stack([rows[-1] for rows in kept], axis=1)
        self._is_pair = np.array([len(rows) == 2 for rows in kept])
        self._is_angle = np.array([variable.periodic for variable in self.variables])
        self.bounds: FloatArray = np.array([self._bounds_of(name) for name in names])
        is_common = (self._first == self._first[0]) & (self._last == self._last[0])
        self.common = tuple(compress(names, is_common.all(axis=0) & (len(spaces) == 1)))

    def _common_names(self) -> list[str]:
        """Return the names of the numbers that all players observe, as the first one has them."""
        first = self._entries[0]
        for other in self._entries[1:]:
            if set(other.keys) != set(first.keys):
                keys, others = (", ".join(map(str, own.keys)) or "none" for own in (first, other))
                raise ValueError(
                    f"observations: of {first.player} keys are {keys}, of {other.player} {others}, "
                    "allowed: the same keys"
                )
        shared = set(first.names).intersection(*(other.names for other in self._entries))
        most = max(len(own.names) for own in self._entries)
        if len(shared) < most and not self._settings.variables:
            raise ValueError(
                "scenario.variables: players observe differently many numbers, say which to take"
            )
        return [name for name in first.names if name in shared]

    def _find_variables(self) -> dict[str, IntArray]:
        """Return where variables are in what bodies observe.

        ``(1, bodies)``, or of angles ``(2, bodies)`` of cosine and sine.
        """
        settings = self._settings
        angles = {
            name: self._find(f"angles.{name}", entries) for name, entries in settings.angles.items()
        }
        places = {
            name: self._find(f"variables.{name}", entries)
            for name, entries in settings.variables.items()
        }
        if not settings.variables:
            used = {int(i) for rows in angles.values() for i in rows.ravel()}
            for i, name in enumerate(self._names):
                if i not in used:
                    places[name] = np.full((1, len(self._players)), i)
        for name in angles.keys() & places.keys():
            raise ValueError(f"scenario.angles.{name}: another state variable has this name")
        return places | angles

    def _find(self, key: str, entries: Entries | Direction) -> IntArray:
        """Return where a variable is: ``(1, bodies)``, ``(2, bodies)`` of cosine and sine."""
        if isinstance(entries, Direction):
            ends = self._find(key, entries.cos), self._find(key, entries.sin)
            return np.concatenate(ends)
        n = len(self._players)
        count = len(self._names)
        each = entries if isinstance(entries, tuple) else (entries,) * n
        known: list[str | int] = [*self._names, *range(count)]
        if len(each) != n or not set(each) <= set(known):
            raise ValueError(
                f"scenario.{key} = {entries}: must be a number of the observation, 0 to "
                f"{count - 1} or {', '.join(self._names)}, or a list of one for each of "
                f"{n} bodies"
            )
        return np.array([[known.index(entry) % count for entry in each]], dtype=np.int64)

    def _describe(self, met: Callable[[], FloatArray]) -> Iterator[Variable]:
        """Yield the variables; of all that there are, those that change."""
        settings = self._settings
        is_discrete = all(isinstance(own.space, Discrete) for own in self._entries)
        for name, rows in self._places.items():
            own = settings.centres.get(name, ())
            if name in settings.angles:
                yield Variable(name, "rad", -np.pi, np.pi, periodic=True, centres=own)
                continue
            ends = self._ends(self._bounds, rows)
            if name in settings.ranges:
                ends = settings.ranges[name]
            elif not np.isfinite(ends).all():
                ends = self._ends(met(), rows)
            low, high = ends
            if low < high:
                has_few = is_discrete and high - low < MOST_CENTRES
                each = tuple(np.arange(low, high + 1.0).tolist()) if has_few else ()
                yield Variable(name, "1", low, high, centres=own or each)
            elif settings.variables:
                raise ValueError(
                    f"scenario.variables.{name}: the environment gives it no bounds, and in "
                    f"random episodes it is always {low:g}; give scenario.ranges.{name}"
                )

    def _ends(self, bounds: FloatArray, rows: IntArray) -> tuple[float, float]:
        """Return the bounds of a variable: those of all players that it is read from."""
        low = bounds[self._players, 0, rows].min()
        high = bounds[self._players, 1, rows].max()
        return float(low), float(high)

    def _bounds_of(self, name: str) -> tuple[float, float]:
        """Return between which numbers a variable lies, as spaces say, but for rounding."""
        if name in self._settings.angles:
            return -np.pi, np.pi
        if name in self._settings.ranges:
            return -np.inf, np.inf
        low, high = self._ends(self._bounds, self._places[name])
        slack = ROUNDING * max(abs(end) for end in (low, high, 1.0) if np.isfinite(end))
        return low - slack, high + slack

    def _check_known(self, names: Sequence[str]) -> None:
        """Refuse settings of variables that there are not."""
        settings = self._settings
        success = settings.success if isinstance(settings.success, dict) else {}
        tables = {
            "ranges": settings.ranges.keys(),
            "centres": settings.centres.keys(),
            "success": success.keys() - {"return"},
        }
        for key, wanted in tables.items():
            for name in wanted:
                if name not in names:
                    known = ", ".join(names)
                    raise ValueError(f"scenario.{key}.{name}: no state variable, known: {known}")

    def numbers(self, played: Played) -> FloatArray:
        """Return the numbers ``(players, k)`` of what players observe.

        Raises
        ------
        ValueError
            If they do not fit the space, or one that is perceived is not finite; one line.
        """
        rows = []
        for own, columns in zip(self._entries, self._columns, strict=True):
            rows.append(own.numbers(played.observations[own.player], played.step)[columns])
        numbers: FloatArray = np.array(rows)
        wrong = np.argwhere(self._is_read & ~np.isfinite(numbers))
        for p, column in wrong:
            of = of_player("observations", self._entries[p].player)
            raise ValueError(
                f"{of}: {self._called(p, column)} is {numbers[p, column]} {at(played.step)}, "
                "allowed: finite numbers"
            )
        return numbers

    def _called(self, player: int, column: int) -> str:
        """Return the name of the state variable that a player's number is."""
        for name, rows in self._places.items():
            if (rows == column)[:, self._players == player].any():
                return name
        return self._names[column]

    def states(self, played: Played) -> FloatArray:
        """Return the states ``(bodies, d)`` of every body."""
        numbers = self.numbers(played)[self._players]
        bodies = np.arange(len(numbers))[:, None]
        states: FloatArray = numbers[bodies, self._first]
        turned = np.where(self._is_pair, np.arctan2(numbers[bodies, self._last], states), states)
        angles = np.where(self._is_pair, turned, wrap(turned))
        return np.where(self._is_angle, angles, states)
