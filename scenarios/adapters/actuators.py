"""What the agents of a foreign environment do: an agent for every number of an action."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium.spaces import Box, Discrete

from ...core.interface.spaces import ActionSet
from ...core.numerics import FloatArray, IntArray
from ..faults.wrappers import limits_of
from .entries import MOST_BOUND
from .simulators import ONLY, Player, Space, of_player


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
        spaces: Mapping[Player, Space],
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
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"agents {', '.join(self.names)}: their names must differ")
        self._spans = dict(zip(spaces, self.groups, strict=True))
        self.players = list(spaces)
        self.roles = self.names
        if len(spaces) == 1:
            self._embody(bodies)
        if len(spaces) > 1 or bodies:
            self.roles = tuple(map(_role, self.names))
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

    def commands(self, joint_action: IntArray) -> dict[Player, object]:
        """Return the players' actions for a joint action ``(n,)``."""
        commanded = self._commanded[np.arange(len(joint_action)), joint_action]
        commands: dict[Player, object] = {}
        for player, space in self._spaces.items():
            own = commanded[list(self._spans[player])]
            if isinstance(space, Discrete):
                commands[player] = int(own[0])
            else:
                commands[player] = own.reshape(space.shape).astype(space.dtype)
        return commands


def _commands(player: Player, space: Space, levels: int) -> Sequence[FloatArray]:
    """Return what each of a player's agents may command, a row for each."""
    of = of_player("actions", player)
    low, high = limits_of(space, of)
    if not isinstance(space, Box):
        ends = zip(low, high, strict=True)
        return [np.arange(first, last + 1, dtype=float) for first, last in ends]
    if max(np.abs(low).max(), np.abs(high).max()) > MOST_BOUND:
        raise ValueError(
            f"{of}: {space}, allowed: bounds within {MOST_BOUND:,.0f}, wrap it in RescaleAction"
        )
    return list(np.linspace(low, high, levels, dtype=float).T)


def _names(player: Player, count: int) -> list[str]:
    if player == ONLY:
        return [f"actuator{k + 1}" for k in range(count)]
    name = str(player)
    return [name] if count == 1 else [f"{name}.{k + 1}" for k in range(count)]


def _role(name: str) -> str:
    """Return the role of an agent: agents are alike whose names differ in one number alone.

    Examples
    --------
    >>> _role("walker_0.2"), _role("12"), _role("0.2")
    ('walker.2', 'player', 'player.2')
    """
    role = re.sub(r"_?\d+(?=$|[.])", "", name, count=1)
    return f"player{role}" if role == "" or role[0] == "." else role
