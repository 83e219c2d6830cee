"""The players of a foreign environment: what they do and what they observe.

There is an agent for every number of their actions; state variables are numbers of what they
observe.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from itertools import compress
from typing import Any, cast

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete
from gymnasium.spaces.utils import flatten, flatten_space

from ...core.interface.spaces import ActionSet, Variable
from ...core.numerics import FloatArray, IntArray, wrap
from ..faults.wrappers import limits_of
from .settings import AdaptedSettings, Direction

MOST_BOUND = 1e6
"""A bound of a space beyond it is none."""
MOST_CENTRES = 32
"""Values of a discrete observation that each have a membership function of their own, at most."""


class Actuators:
    """What the agents' actions command, by player.

    Parameters
    ----------
    spaces
        Of the players' actions.
    levels
        Of each dimension of a Box.
    neutral
        Index of the neutral action; None: the level nearest to 0, or the first discrete action.
    bodies
        The agents of each body of an only player; none: each is its own. Of several players each
        is a body.

    Attributes
    ----------
    names, roles
        Of the agents.
    groups
        Agents by body.
    players
        Whose each body is.
    action_set
        Of every agent, the actions of the one that has most.

    Raises
    ------
    ValueError
        If actions are of other kinds, unbounded or mixed, or bodies do not hold all agents; one
        line.
    """

    def __init__(
        self,
        spaces: Mapping[str, Any],
        levels: int,
        neutral: int | None,
        bodies: Sequence[Sequence[int]] = (),
    ) -> None:
        self._spaces = spaces
        tables = {player: _commands(player, space, levels) for player, space in spaces.items()}
        if len({isinstance(space, Box) for space in spaces.values()}) > 1:
            raise ValueError("actions: some are continuous and some discrete, allowed: one kind")
        rows = [row for table in tables.values() for row in table]
        n_actions = max(map(len, rows))
        if n_actions < 2:
            raise ValueError("actions: agents have 1 each, allowed: at least 2")
        # An agent with fewer actions has them again from the first on.
        self._commanded = np.array([np.resize(row, n_actions) for row in rows])
        self.names: tuple[str, ...] = ()
        self.groups: tuple[tuple[int, ...], ...] = ()
        for player, table in tables.items():
            first = len(self.names)
            self.groups += (tuple(range(first, first + len(table))),)
            self.names += tuple(_names(player, len(table)))
        self._spans = [slice(group[0], group[-1] + 1) for group in self.groups]
        self.players, self.roles = list(spaces), self.names
        if len(spaces) == 1:
            self._embody(bodies)
        if len(spaces) > 1 or bodies:  # alike but for their numbers
            self.roles = tuple(re.sub(r"_?\d+(?=$|[.])", "", name, count=1) for name in self.names)
        self.action_set = self._action_set(neutral)

    def _embody(self, bodies: Sequence[Sequence[int]]) -> None:
        """Make the agents of an only player those of bodies."""
        singles = tuple((i,) for i in range(len(self.names)))
        if bodies and [(i,) for body in bodies for i in body] != [*singles]:
            raise ValueError(
                f"scenario.groups = {[list(body) for body in bodies]}: must hold the numbers 0 to "
                f"{len(singles) - 1} of the agents once each, in order"
            )
        if bodies:
            named = enumerate(bodies, 1)
            self.names = tuple(f"body{b}.{k + 1}" for b, body in named for k in range(len(body)))
        self.groups = tuple(map(tuple, bodies)) or singles
        self.players = self.players * len(self.groups)

    def _action_set(self, neutral: int | None) -> ActionSet:
        is_continuous = isinstance(next(iter(self._spaces.values())), Box)
        table = self._commanded
        n_actions = table.shape[1]
        if neutral is None:
            neutral = int(np.abs(table).sum(axis=0).argmin()) if is_continuous else 0
        if neutral >= n_actions:
            raise ValueError(f"scenario.neutral = {neutral}: allowed 0 to {n_actions - 1}")
        names = tuple(f"{v:.3g}" for v in table[0]) if (table == table[0]).all() else ()
        if len(set(names)) < n_actions:
            names = tuple(map(str, range(n_actions)))
        nothing = (0.0,) * n_actions
        return ActionSet(names, nothing, nothing, neutral)

    def commands(self, joint_action: IntArray) -> dict[str, Any]:
        """Return the players' actions for a joint action ``(n,)``."""
        commanded = self._commanded[np.arange(len(joint_action)), joint_action]
        given: dict[str, Any] = {}
        for (player, space), span in zip(self._spaces.items(), self._spans, strict=True):
            own, is_one = commanded[span], isinstance(space, Discrete)
            given[player] = int(own[0]) if is_one else own.reshape(space.shape).astype(space.dtype)
        return given


def _commands(player: str, space: Any, levels: int) -> Sequence[FloatArray]:
    """Return what each of a player's agents may command, a row for each."""
    low, high = limits_of(space, f"actions of {player}" if player else "actions")
    if isinstance(space, Box):
        return list(np.linspace(low, high, levels, dtype=float).T)
    return [np.arange(first, last + 1, dtype=float) for first, last in zip(low, high, strict=True)]


def _names(player: str, count: int) -> list[str]:
    if not player:
        return [f"actuator{k + 1}" for k in range(count)]
    return [player] if count == 1 else [f"{player}.{k + 1}" for k in range(count)]


def bounds_of(player: str, space: Any) -> FloatArray:
    """Return the bounds ``(2, k)`` of the numbers that a player observes, infinite where none are.

    Raises
    ------
    ValueError
        If these are images or no numbers; one line.
    """
    of = f"observations of {player}" if player else "observations"
    if isinstance(space, Discrete):
        return np.array([[space.start], [space.start + space.n - 1]], dtype=np.float64)
    for part in space.values() if isinstance(space, Dict) else [space]:
        if not isinstance(part, Box | Discrete | MultiDiscrete | MultiBinary):
            raise ValueError(f"{of}: {part}, allowed: a fixed number of numbers")
        if isinstance(part, Box) and len(part.shape) > 1 and part.dtype == np.uint8:
            raise ValueError(
                f"{of}: images of shape {part.shape}, allowed: numbers; many environments have "
                "another id or option whose observations are states"
            )
    flat = cast(Box, flatten_space(space))
    ends = np.array([flat.low, flat.high], dtype=np.float64)
    return np.where(np.abs(ends) > MOST_BOUND, np.copysign(np.inf, ends), ends)


def names_of(space: Any) -> list[str]:
    """Return the names of the numbers of an observation: of a Dict by its keys, else o0 and on."""
    if isinstance(space, Discrete):
        return ["o0"]
    if not isinstance(space, Dict):
        return [f"o{i}" for i in range(cast(Box, flatten_space(space)).shape[0])]
    counts = {key: cast(Box, flatten_space(part)).shape[0] for key, part in space.items()}
    return [
        key if count == 1 else f"{key}{i}" for key, count in counts.items() for i in range(count)
    ]


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
        Returns the least and greatest numbers ``(2, k)`` of random episodes, given what makes them
        of observations.

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
        met: Callable[[Any], FloatArray],
    ) -> None:
        self._spaces, self._angles = spaces, settings.angles
        self._players = [list(spaces).index(player) for player in bodies]
        every = [bounds_of(player, space) for player, space in spaces.items()]
        self._bounds = min(every, key=len)
        self._lengths = [bounds.shape[1] for bounds in every]
        self._count = min(self._lengths)
        self._names = names_of(next(iter(spaces.values())))[: self._count]
        if not settings.variables and max(self._lengths) > self._count:
            raise ValueError(
                "scenario.variables: players observe differently many numbers, say which to take"
            )
        # Where variables are in what bodies observe: one row, of angles cosine and sine two.
        angles = {name: self._find(name, entries) for name, entries in settings.angles.items()}
        places = {name: self._find(name, entries) for name, entries in settings.variables.items()}
        if not settings.variables:
            used = {int(i) for rows in angles.values() for i in rows.ravel()}
            left = [i for i in range(self._count) if i not in used]
            places = {self._names[i]: np.full((1, len(bodies)), i) for i in left}
        for name in angles.keys() & places.keys():
            raise ValueError(f"scenario.angles.{name}: another state variable has this name")
        places |= angles
        self.variables = tuple(self._described(settings, places, cache(partial(met, self.numbers))))
        names = [variable.name for variable in self.variables]
        for key in ("ranges", "centres", "success"):
            for name in getattr(settings, key):
                if name not in names and (key, name) != ("success", "return"):
                    known = ", ".join(names)
                    raise ValueError(f"scenario.{key}.{name}: no state variable, known: {known}")
        if not self.variables:
            raise ValueError("observations: none of their numbers changes in random episodes")
        kept = [places[variable.name] for variable in self.variables]
        self._first = np.stack([rows[0] for rows in kept], axis=1)
        self._last = np.stack([rows[-1] for rows in kept], axis=1)
        self._is_pair = np.array([len(rows) == 2 for rows in kept])
        self._is_angle = np.array([variable.periodic for variable in self.variables])
        is_common = (self._first == self._first[0]) & (self._last == self._last[0])
        self.common = tuple(compress(names, is_common.all(axis=0) & (len(spaces) == 1)))

    def _find(self, name: str, entries: Any) -> Any:
        """Return where a variable is: ``(1, bodies)``, ``(2, bodies)`` of cosine and sine."""
        if isinstance(entries, Direction):
            return np.concatenate([self._find(name, entries.cos), self._find(name, entries.sin)])
        n = len(self._players)
        each = entries if isinstance(entries, tuple) else (entries,) * n
        known: list[str | int] = [*self._names, *range(self._count)]
        if len(each) != n or not set(each) <= set(known):
            key = f"{'angles' if name in self._angles else 'variables'}.{name}"
            raise ValueError(
                f"scenario.{key} = {entries}: must be a number of the observation, 0 to "
                f"{self._count - 1} or {', '.join(self._names)}, or a list of one for each of "
                f"{n} bodies"
            )
        return np.array([[known.index(entry) % self._count for entry in each]], dtype=np.int64)

    def _described(
        self, settings: AdaptedSettings, places: Mapping[str, Any], met: Callable[[], FloatArray]
    ) -> Iterator[Variable]:
        """Yield the variables; of all that there are, those that change."""
        is_discrete = isinstance(next(iter(self._spaces.values())), Discrete)
        for name, rows in places.items():
            own = settings.centres.get(name, ())
            if name in self._angles:
                yield Variable(name, "rad", -np.pi, np.pi, periodic=True, centres=own)
                continue
            bounds = self._bounds[:, : self._count]
            if name not in settings.ranges and not np.isfinite(bounds[:, rows]).all():
                bounds = met()
            given = bounds[0, rows].min(), bounds[1, rows].max()
            low, high = map(float, settings.ranges.get(name, given))
            if low < high:
                values = np.arange(low, high + 1.0).tolist() if is_discrete else []
                each = tuple(values) if len(values) <= MOST_CENTRES else ()
                yield Variable(name, "1", low, high, centres=own or each)
            elif settings.variables:
                raise ValueError(
                    f"scenario.variables.{name}: the environment gives it no bounds, and in "
                    f"random episodes it is always {low:g}; give scenario.ranges.{name}"
                )

    def numbers(self, observations: Mapping[str, Any]) -> FloatArray:
        """Return the numbers ``(players, k)`` of what players observe."""
        rows: list[Any] = []
        for (player, space), length in zip(self._spaces.items(), self._lengths, strict=True):
            seen = observations[player]
            rows.append([seen] if isinstance(space, Discrete) else flatten(space, seen))
            if len(rows[-1]) != length:
                raise ValueError(f"observed are {len(rows[-1])} numbers, of {space}")
        return np.array([row[: self._count] for row in rows], dtype=np.float64)

    def states(self, observations: Mapping[str, Any]) -> FloatArray:
        """Return the states ``(bodies, d)`` of every body."""
        numbers = self.numbers(observations)[self._players]
        bodies = np.arange(len(numbers))[:, None]
        states: FloatArray = numbers[bodies, self._first]
        turned = np.where(self._is_pair, np.arctan2(numbers[bodies, self._last], states), states)
        angles = np.where(self._is_pair, turned, wrap(turned))
        return np.where(self._is_angle, angles, states)
