"""The agents of a foreign environment: one for every number of its players' actions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete

from ...core.interface.spaces import ActionSet
from ...core.numerics.arrays import FloatArray, IntArray
from ..faults.action_scales import limits_of


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

    Attributes
    ----------
    names
        Of the agents.
    groups
        Agents by player.
    action_set
        Of every agent, the actions of the one that has most.

    Raises
    ------
    ValueError
        If actions are of other kinds, unbounded or mixed; one line.
    """

    def __init__(self, spaces: Mapping[str, Any], levels: int, neutral: int | None) -> None:
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
        self.groups: tuple[tuple[int, ...], ...] = ()
        self.names: tuple[str, ...] = ()
        for player, table in tables.items():
            first = len(self.names)
            self.groups += (tuple(range(first, first + len(table))),)
            self.names += tuple(_names(player, len(table)))
        self.action_set = self._action_set(neutral)

    def _action_set(self, neutral: int | None) -> ActionSet:
        is_continuous = isinstance(next(iter(self._spaces.values())), Box)
        table = self._commanded
        n_actions = table.shape[1]
        if neutral is None:
            neutral = int(np.abs(table).sum(axis=0).argmin()) if is_continuous else 0
        if neutral >= n_actions:
            raise ValueError(f"scenario.neutral = {neutral}: allowed 0 to {n_actions - 1}")
        is_alike = (table == table[0]).all()
        names = tuple(f"{v:.3g}" for v in table[0]) if is_alike else ()
        if len(set(names)) < n_actions:
            names = tuple(map(str, range(n_actions)))
        nothing = (0.0,) * n_actions
        return ActionSet(names, nothing, nothing, neutral)

    def commands(self, joint_action: IntArray) -> dict[str, Any]:
        """Return the players' actions for a joint action ``(n,)``."""
        commanded = self._commanded[np.arange(len(joint_action)), joint_action]
        given = {}
        for (player, space), group in zip(self._spaces.items(), self.groups, strict=True):
            own = commanded[group[0] : group[-1] + 1]
            is_one = isinstance(space, Discrete)
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
