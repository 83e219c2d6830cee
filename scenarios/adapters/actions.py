"""Actions of an environment: one agent for each number of an action."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium.spaces import Box, Discrete

from ...core.interface.spaces import ActionSet
from ...core.numerics import FloatArray, IntArray
from ..faults.wrappers import action_bounds
from ..library_types import Space
from .entries import MAX_BOUND
from .simulators import SINGLE, Player, describe


class ActionMap:
    """The agents of an environment, and the translation of their actions into its actions.

    Every dimension of a player's action is an agent. Agents with fewer actions than others repeat
    theirs from the first on.

    Parameters
    ----------
    spaces
        Action spaces by player.
    levels
        Number of evenly spaced levels of each dimension of a Box.
    neutral
        Index of the neutral action. None selects the level nearest to 0, or the first discrete
        action.
    groups
        Agents of each body of a single player. If empty, every agent is a body of its own. Each
        player of several is one body.

    Attributes
    ----------
    names, roles
        Name and role of each agent.
    groups
        Agents of each body.
    players
        Player of each body.
    action_set
        Actions of every agent.

    Raises
    ------
    ValueError
        If a space is unbounded or of another kind, kinds are mixed, or groups are not a partition.
    """

    def __init__(
        self,
        spaces: Mapping[Player, Space],
        levels: int,
        neutral: int | None,
        groups: Sequence[Sequence[int]] = (),
    ) -> None:
        self._spaces = spaces
        self._is_continuous = isinstance(next(iter(spaces.values())), Box)
        if any(isinstance(space, Box) != self._is_continuous for space in spaces.values()):
            raise ValueError("actions: some continuous, some discrete, allowed: one kind")
        tables = {player: _values(player, space, levels) for player, space in spaces.items()}
        n_actions = max(len(values) for table in tables.values() for values in table)
        if n_actions < 2:
            raise ValueError("actions: agents have 1 each, allowed: at least 2")
        # (n_agents, n_actions) values of the actions of each agent
        self._values = np.array(
            [np.resize(values, n_actions) for table in tables.values() for values in table]
        )
        ends = np.cumsum([len(table) for table in tables.values()]).tolist()
        starts = [0, *ends[:-1]]
        bodies = [tuple(range(*span)) for span in zip(starts, ends, strict=True)]
        self._members = dict(zip(spaces, bodies, strict=True))
        self.players = list(spaces)
        self.groups = tuple(bodies)
        if len(spaces) == 1:
            self.groups = _checked_groups(groups, len(self._values))
            self.players *= len(self.groups)
        prefixes, named = list(map(str, spaces)), tuple(bodies)
        if SINGLE in spaces:
            kind, named = "body" if groups else "actuator", self.groups
            prefixes = [f"{kind}{b}" for b in range(1, len(named) + 1)]
        self.names = tuple(
            prefix if len(body) == 1 and not groups else f"{prefix}.{k}"
            for prefix, body in zip(prefixes, named, strict=True)
            for k in range(1, len(body) + 1)
        )
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"agents {', '.join(self.names)}: their names must differ")
        has_bodies = len(spaces) > 1 or bool(groups)
        self.roles = tuple(map(_role, self.names)) if has_bodies else self.names
        self.action_set = self._action_set(neutral)

    def _action_set(self, neutral: int | None) -> ActionSet:
        n_actions = self._values.shape[1]
        if neutral is None:
            distance = np.abs(self._values).sum(axis=0)
            neutral = int(distance.argmin()) if self._is_continuous else 0
        if neutral >= n_actions:
            raise ValueError(f"scenario.neutral = {neutral}, allowed: 0 to {n_actions - 1}")
        is_common = (self._values == self._values[0]).all()
        names = tuple(f"{value:.3g}" for value in self._values[0]) if is_common else ()
        if len(set(names)) < n_actions:
            names = tuple(map(str, range(n_actions)))
        zeros = (0.0,) * n_actions
        return ActionSet(names, zeros, zeros, neutral)

    def environment_actions(self, joint_action: IntArray) -> dict[Player, object]:
        """Return the actions of the players for a joint action ``(n,)``."""
        values = self._values[np.arange(len(joint_action)), joint_action]
        actions: dict[Player, object] = {}
        for player, space in self._spaces.items():
            own = values[list(self._members[player])]
            if isinstance(space, Discrete):
                actions[player] = int(own[0])
            else:
                actions[player] = own.reshape(space.shape).astype(space.dtype)
        return actions


def _checked_groups(groups: Sequence[Sequence[int]], n: int) -> tuple[tuple[int, ...], ...]:
    """Return the groups of the agents of a single player."""
    if not groups:
        return tuple((i,) for i in range(n))
    if [i for group in groups for i in group] != list(range(n)):
        raise ValueError(
            f"scenario.groups = {[list(group) for group in groups]}, allowed: each of the agents 0 "
            f"to {n - 1} once, in order"
        )
    return tuple(map(tuple, groups))


def _values(player: Player, space: Space, levels: int) -> Sequence[FloatArray]:
    """Return the values of the actions of each agent of a player."""
    name = describe("actions", player)
    low, high = action_bounds(space, name)
    if not isinstance(space, Box):
        return [np.arange(a, b + 1, dtype=float) for a, b in zip(low, high, strict=True)]
    if max(np.abs(low).max(), np.abs(high).max()) > MAX_BOUND:
        raise ValueError(
            f"{name}: {space}, allowed: bounds within {MAX_BOUND:,.0f}; wrap it in RescaleAction"
        )
    values = np.linspace(low, high, levels, dtype=float)
    if np.issubdtype(space.dtype, np.integer):
        most = int((high - low).min()) + 1
        if levels > most:
            raise ValueError(f"scenario.actions = {levels}: {name}: {space}, allowed: 2 to {most}")
        values = np.rint(values)
    return list(values.T)


def _role(name: str) -> str:
    """Return the role of an agent: its name without the first number.

    Examples
    --------
    >>> _role("walker_0.2"), _role("12"), _role("0.2")
    ('walker.2', 'player', 'player.2')
    """
    role = re.sub(r"_?\d+(?=$|[.])", "", name, count=1)
    return f"player{role}" if role == "" or role[0] == "." else role
