"""Gymnasium and PettingZoo environments behind one interface.

A *player* acts and observes: the single agent of a Gymnasium environment, or an agent of a
PettingZoo environment. A player that has left an episode keeps its last observation and receives no
reward. An episode ends when every acting player has terminated or been truncated.

What an environment returns is checked here and in `observations`, so that inner code can trust it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, TypeAlias

import gymnasium
import numpy as np
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import aec_to_parallel

from ...core.plugins.printing import printable

Player = Hashable
"""Id of a PettingZoo agent, or `SINGLE` for the agent of a Gymnasium environment."""
Space: TypeAlias = gymnasium.Space[Any]
Environment: TypeAlias = "gymnasium.Env[Any, Any] | ParallelEnv[Any, Any, Any]"
SINGLE: Player = None
"""The player of a Gymnasium environment, which has no name."""


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


class Simulator(ABC):
    """An environment with players.

    `reset` and `step` raise `ValueError` with a one-line message if the environment returns
    something that its interface does not allow.
    """

    env: Environment
    players: tuple[Player, ...]
    observation_spaces: Mapping[Player, Space]
    action_spaces: Mapping[Player, Space]

    @abstractmethod
    def reset(self, seed: int) -> EnvironmentStep:
        """Start an episode."""

    @abstractmethod
    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute the actions of the players that are still present."""


class GymnasiumSimulator(Simulator):
    """A Gymnasium environment with one player."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        self.env: gymnasium.Env[Any, Any] = env
        self.players = (SINGLE,)
        self.observation_spaces = {SINGLE: env.observation_space}
        self.action_spaces = {SINGLE: env.action_space}
        self._steps = 0

    def reset(self, seed: int) -> EnvironmentStep:
        """Start an episode."""
        observation, _ = _unpack(self.env.reset(seed=seed), "reset", 2)
        self._steps = 0
        return EnvironmentStep({SINGLE: observation}, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute an action."""
        observation, reward, *ends, _ = _unpack(self.env.step(actions[SINGLE]), "step", 5)
        self._steps += 1
        rewards = {SINGLE: _reward(reward, SINGLE, self._steps)}
        terminated, truncated = map(bool, ends)
        return EnvironmentStep({SINGLE: observation}, rewards, terminated, truncated, self._steps)


class PettingZooSimulator(Simulator):
    """A parallel PettingZoo environment."""

    def __init__(self, env: ParallelEnv[Any, Any, Any]) -> None:
        self.env: ParallelEnv[Any, Any, Any] = env
        self.players = tuple(env.possible_agents)
        self.observation_spaces = {p: env.observation_space(p) for p in self.players}
        self.action_spaces = {p: env.action_space(p) for p in self.players}
        self._steps = 0
        self._observations: dict[Player, object] = {}
        self._terminated: set[Player] = set()
        self._ended: set[Player] = set()

    def reset(self, seed: int) -> EnvironmentStep:
        """Start an episode."""
        observations, _ = _unpack(self.env.reset(seed=seed), "reset", 2)
        self._steps = 0
        self._observations = {
            player: self._entry(observations, player, "observations") for player in self.players
        }
        self._terminated = set()
        self._ended = set()
        return EnvironmentStep(self._observations, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute the actions of the players that are still present."""
        chosen = {player: self._entry(actions, player, "players") for player in self.env.agents}
        observations, rewards, terminations, truncations, _ = _unpack(
            self.env.step(chosen), "step", 5
        )
        self._steps += 1
        received = dict.fromkeys(self.players, 0.0)
        for player in chosen.keys() - self._ended:
            reward = self._entry(rewards, player, "rewards")
            received[player] = _reward(reward, player, self._steps)
            if self._entry(terminations, player, "terminations"):
                self._terminated.add(player)
            if player in self._terminated or self._entry(truncations, player, "truncations"):
                self._ended.add(player)
            else:
                self._entry(observations, player, "observations")
        known = {player: observations[player] for player in self.players if player in observations}
        self._observations = {**self._observations, **known}
        is_over = self._ended.issuperset(self.env.agents)
        terminated = is_over and self._terminated.issuperset(self.players)
        truncated = is_over and not terminated
        return EnvironmentStep(self._observations, received, terminated, truncated, self._steps)

    def _entry(self, table: Mapping[Player, Any], player: Player, name: str) -> Any:
        if player not in table:
            hint = "" if self._steps else "; all of possible_agents must be present at reset"
            raise ValueError(f"{name} {when(self._steps)}: {player!r} is missing{hint}")
        return table[player]


def make_simulator(env: object) -> Simulator:
    """Return the simulator of a Gymnasium or PettingZoo environment.

    Raises
    ------
    ValueError
        If the object is not an environment, or has agents that act in turns and cannot be made
        parallel.
    """
    if isinstance(env, AECEnv):
        if not (env.metadata or {}).get("is_parallelizable", False):
            raise ValueError("its agents act in turns, allowed: agents that act simultaneously")
        for name in env.possible_agents:
            if not isinstance(name, str):
                raise ValueError(
                    f"possible_agents: {name!r} is not text, which PettingZoo requires to make an "
                    "AEC environment parallel"
                )
        env = aec_to_parallel(env)
    if isinstance(env, ParallelEnv):
        return PettingZooSimulator(env)
    if isinstance(env, gymnasium.Env):
        return GymnasiumSimulator(env)
    name = type(env).__name__
    raise ValueError(f"is {name}, allowed: gymnasium.Env, or ParallelEnv or AECEnv of PettingZoo")


def _unpack(returned: object, method: str, count: int) -> tuple[Any, ...]:
    if isinstance(returned, tuple) and len(returned) == count:
        return returned
    given = f"{len(returned)} values" if isinstance(returned, tuple) else type(returned).__name__
    raise ValueError(
        f"{method} returns {given}, allowed: {count} values (Gymnasium before 0.26 and PettingZoo "
        "before 1.23 are not supported)"
    )


def _reward(value: object, player: Player, step: int) -> float:
    """Return a reward as a float; arrays of one number are allowed."""
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf" or not np.isfinite(array).all():
        raise ValueError(
            f"{describe('reward', player)} {when(step)} = {value!r:.40}, allowed: one finite number"
        )
    return float(array.item())
