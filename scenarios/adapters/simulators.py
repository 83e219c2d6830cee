"""Gymnasium and PettingZoo environments behind one interface.

A *player* acts and observes: the single agent of a Gymnasium environment, or an agent of a
PettingZoo environment. A player that has left an episode keeps its last observation and receives no
reward. An episode ends when every acting player has terminated or been truncated.

Whatever an environment returns is checked here, so that inner code can trust it.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from copy import deepcopy
from math import isfinite
from typing import NamedTuple

import gymnasium
import numpy as np
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import aec_to_parallel

from ...core.plugins.printing import printable
from ..library_types import Data, Environment

Player = Hashable
"""Id of a PettingZoo agent, or `SINGLE` for the agent of a Gymnasium environment."""
SINGLE: Player = None
"""The player of a Gymnasium environment, which has no name."""
PARTS = ("observations", "rewards", "terminations", "truncations")
"""Parts of what ``step`` of a parallel environment returns, in order, each by player."""
MASK_KEYS = ("action_mask", "action_masks", "avail_actions", "available_actions", "legal_moves")
"""Keys under which environments give action masks."""


def describe(part: str, player: Player) -> str:
    """Return a part of the environment's interface with its player, for messages.

    Examples
    --------
    >>> describe("observation", SINGLE), describe("reward", 0), describe("reward", "")
    ('observation', 'reward of 0', "reward of ''")
    """
    if player is SINGLE:
        return part
    return f"{part} of {printable(str(player)) or repr(player)}"


def when(step: int) -> str:
    """Return the time of a step for messages; step 0 is the reset."""
    return "at reset" if step == 0 else f"at step {step}"


class EnvironmentStep(NamedTuple):
    """Result of ``reset`` or ``step`` of an environment, by player."""

    observations: Mapping[Player, object]
    rewards: Mapping[Player, float]
    """Rewards of all players; empty after a reset."""
    terminated: bool
    truncated: bool
    step: int
    """Number of steps since the reset."""

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended."""
        return self.terminated or self.truncated


class Simulator:
    """A Gymnasium environment with one player, or a parallel PettingZoo environment.

    `reset` and `step` raise `ValueError` with a one-line message if the environment returns
    something that its interface does not allow.

    Raises
    ------
    ValueError
        If a PettingZoo environment does not declare ``possible_agents``.
    """

    def __init__(self, env: Environment, players: Sequence[Player] | None = (SINGLE,)) -> None:
        self.env = env
        self.players = tuple(players or ())
        self.is_single = self.players == (SINGLE,)
        if self.is_single:
            self.observation_spaces = {SINGLE: env.observation_space}
            self.action_spaces = {SINGLE: env.action_space}
        else:
            self.observation_spaces = {p: env.observation_space(p) for p in self.players}
            self.action_spaces = {p: env.action_space(p) for p in self.players}
        if not self.players:
            raise ValueError(
                "possible_agents is missing or empty, allowed: all agents that may act"
            )
        self._steps = 0
        # These three are replaced, never modified, because copies of a simulator share them.
        self._observations: Mapping[Player, object] = {}
        self._terminated: frozenset[Player] = frozenset()
        self._ended: frozenset[Player] = frozenset()

    def reset(self, seed: int) -> EnvironmentStep:
        """Start an episode."""
        returned = _unpack_reset(self.env.reset(seed=seed))
        self._steps = 0
        observations = self._by_player(returned[0], "observations")
        self._refuse_masks(returned[1])
        self._require(self.players, observations, "observations")
        self._observations = {player: observations[player] for player in self.players}
        self._terminated = frozenset()
        self._ended = frozenset()
        return EnvironmentStep(self._observations, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute the actions of the players that are still present."""
        acting = self._present()
        self._refuse_unknown(acting, "agents")
        given = {player: actions[player] for player in acting}
        *parts, infos = _unpack_step(self.env.step(given[SINGLE] if self.is_single else given))
        self._steps += 1
        observations, rewards, terminations, truncations = (
            self._by_player(part, name) for part, name in zip(parts, PARTS, strict=True)
        )
        self._refuse_masks(infos)
        playing = [player for player in acting if player not in self._ended]
        for table, name in zip((rewards, terminations, truncations), PARTS[1:], strict=True):
            self._require(playing, table, name)
        self._terminated |= self._flagged(terminations, "terminated")
        self._ended |= self._terminated | self._flagged(truncations, "truncated")
        continuing = [player for player in playing if player not in self._ended]
        self._require(continuing, observations, "observations")
        # An environment may reuse the array of a player that has left: keep a copy of its last one.
        last = {p: deepcopy(observations[p]) for p in self._ended & observations.keys()}
        self._observations = {**self._observations, **observations, **last}
        paid = {player: self._reward(player, rewards) for player in self.players}
        present = frozenset(self._present())
        entered = present.difference(acting)
        self._terminated -= entered
        self._ended -= entered
        is_over = self._ended >= present
        terminated = is_over and self._terminated.issuperset(self.players)
        truncated = is_over and not terminated
        return EnvironmentStep(self._observations, paid, terminated, truncated, self._steps)

    def _present(self) -> list[Player]:
        return [SINGLE] if self.is_single else list(self.env.agents)

    def _by_player(self, part: object, name: str) -> Mapping[Player, Data]:
        """Return a returned table after checking its type and its keys."""
        if self.is_single:
            return {SINGLE: part}
        if not isinstance(part, Mapping):
            raise ValueError(f"{name} {when(self._steps)}: {type(part).__name__}, allowed: a dict")
        self._refuse_unknown(part, name)
        return part

    def _refuse_unknown(self, players: Iterable[Player], name: str) -> None:
        for player in players:
            if player not in self.observation_spaces:
                raise ValueError(
                    f"{name} {when(self._steps)}: {player!r} is not in possible_agents"
                )

    def _require(
        self, players: Iterable[Player], table: Mapping[Player, object], name: str
    ) -> None:
        hint = "" if self._steps else ", allowed: agents that are present from the start"
        for player in players:
            if player not in table:
                raise ValueError(f"{name} {when(self._steps)}: {player!r} is missing{hint}")

    def _flagged(self, flags: Mapping[Player, object], name: str) -> frozenset[Player]:
        """Return the players with a true flag."""
        where = when(self._steps)
        return frozenset(
            player
            for player, flag in flags.items()
            if _number(flag, f"{describe(name, player)} {where}", "true or false")
        )

    def _reward(self, player: Player, rewards: Mapping[Player, object]) -> float:
        name = f"{describe('reward', player)} {when(self._steps)}"
        reward = _number(rewards.get(player, 0.0), name, "one finite number")
        if not isfinite(reward):
            raise ValueError(f"{name} = {reward}, allowed: one finite number")
        return reward

    def _refuse_masks(self, infos: object) -> None:
        for player, info in infos.items() if isinstance(infos, Mapping) else ():
            for key in () if self.is_single else MASK_KEYS:
                if isinstance(info, Mapping) and key in info:
                    raise mask_error(player, f"info has {key}")


def make_simulator(env: object) -> Simulator:
    """Return the simulator of a Gymnasium or PettingZoo environment.

    Raises
    ------
    ValueError
        If the object is not an environment, is a vector of environments, or has agents that act in
        turns and cannot be made parallel.
    """
    if isinstance(env, gymnasium.vector.VectorEnv):
        raise ValueError("is a vector of environments, allowed: a single environment")
    if isinstance(env, AECEnv):
        if not (env.metadata or {}).get("is_parallelizable", False):
            raise ValueError("its agents act in turns, allowed: agents that act simultaneously")
        for name in env.possible_agents:
            if not isinstance(name, str):
                raise ValueError(
                    f"possible_agents: {name!r} is not text, which PettingZoo requires to make an "
                    "AEC environment parallel"
                )
        return Simulator(aec_to_parallel(env), env.possible_agents)
    players = getattr(env, "possible_agents", None)
    if isinstance(env, ParallelEnv) or players is not None:
        return Simulator(env, players)
    if not (hasattr(env, "observation_space") and hasattr(env, "step")):
        name = type(env).__name__
        raise ValueError(f"is {name}, allowed: an environment of Gymnasium or PettingZoo")
    return Simulator(env)


def _unpack_reset(returned: object) -> tuple[object, object]:
    if isinstance(returned, tuple | list) and len(returned) == 2:
        observation, info = returned
        if isinstance(info, Mapping):
            return observation, info
    raise ValueError(
        "reset must return observation and info (Gymnasium before 0.26 and PettingZoo before 1.23 "
        "are not supported)"
    )


def _unpack_step(returned: object) -> tuple[Data, ...]:
    if isinstance(returned, tuple | list) and len(returned) == 5:
        return tuple(returned)
    count = len(returned) if isinstance(returned, tuple | list) else 1
    raise ValueError(
        f"step returns {count} values, allowed: 5, observation, reward, terminated, truncated, "
        "info (Gymnasium before 0.26 and PettingZoo before 1.23 are not supported)"
    )


def _number(value: object, name: str, allowed: str) -> float:
    """Return a reward or a flag as a float.

    Examples
    --------
    >>> _number(np.array([[2.0]], np.float32), "reward", "one finite number")
    2.0
    """
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf":
        raise ValueError(f"{name} = {value!r:.40}, allowed: {allowed}")
    return float(array.item())


def mask_error(player: Player, where: str) -> ValueError:
    """Return the error that action masks are not supported."""
    return ValueError(
        f"{describe('actions', player)}: {where}, allowed: environments without action masks; "
        "wrap yours so that an illegal action does something legal, and drop the mask"
    )
