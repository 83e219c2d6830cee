"""Gymnasium and PettingZoo environments behind one interface.

A *player* acts and observes: the single agent of a Gymnasium environment, or an agent of a
PettingZoo environment. A player that has left an episode keeps its last observation and receives no
reward. An episode ends when every acting player has terminated or been truncated, or when the key
``__all__`` of RLlib says so.

Whatever an environment returns is checked here, so that inner code can trust it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Hashable, Iterable, Mapping
from copy import deepcopy
from typing import NamedTuple

import gymnasium
import numpy as np
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import aec_to_parallel

from ...core.plugins.printing import printable
from ..library_types import Data, Environment, Space

Player = Hashable
"""Id of a PettingZoo agent, or `SINGLE` for the agent of a Gymnasium environment."""
SINGLE: Player = None
"""The player of a Gymnasium environment, which has no name."""
PARTS = ("observations", "rewards", "terminations", "truncations", "infos")
"""Parts of what ``step`` of a parallel environment returns, in order, each by player."""
MASK_KEYS = ("action_mask", "action_masks", "avail_actions", "available_actions", "legal_moves")
"""Keys under which environments give action masks."""
ALL = "__all__"
"""Key of terminations and truncations that RLlib uses for all agents."""


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

    def __init__(self, env: Environment) -> None:
        self.env = env
        self.players = (SINGLE,)
        self.observation_spaces = {SINGLE: env.observation_space}
        self.action_spaces = {SINGLE: env.action_space}
        self._steps = 0

    def reset(self, seed: int) -> EnvironmentStep:
        """Start an episode."""
        observation, _ = _unpack_reset(self.env.reset(seed=seed))
        self._steps = 0
        return EnvironmentStep({SINGLE: observation}, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute an action."""
        observation, reward, *ends, _ = _unpack_step(self.env.step(actions[SINGLE]))
        self._steps += 1
        time = when(self._steps)
        rewards = {SINGLE: _finite_number(reward, f"reward {time}")}
        terminated = _flag(ends[0], f"terminated {time}")
        truncated = _flag(ends[1], f"truncated {time}")
        return EnvironmentStep({SINGLE: observation}, rewards, terminated, truncated, self._steps)


class PettingZooSimulator(Simulator):
    """A parallel PettingZoo environment.

    Raises
    ------
    ValueError
        If the environment does not declare ``possible_agents``.
    """

    def __init__(self, env: Environment) -> None:
        self.env = env
        self.players = tuple(getattr(env, "possible_agents", None) or ())
        if not self.players:
            raise ValueError(
                "possible_agents is missing or empty, allowed: all agents that may act"
            )
        self.observation_spaces = {p: env.observation_space(p) for p in self.players}
        self.action_spaces = {p: env.action_space(p) for p in self.players}
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
        _refuse_masks(self._by_player(returned[1], "infos"))
        self._require(self.players, observations, "observations")
        self._observations = {player: observations[player] for player in self.players}
        self._terminated = frozenset()
        self._ended = frozenset()
        return EnvironmentStep(self._observations, {}, False, False, 0)

    def step(self, actions: Mapping[Player, object]) -> EnvironmentStep:
        """Execute the actions of the players that are still present."""
        acting = list(self.env.agents)
        self._refuse_unknown(acting, "agents")
        parts = _unpack_step(self.env.step({player: actions[player] for player in acting}))
        self._steps += 1
        tables = {
            name: self._by_player(part, name) for name, part in zip(PARTS, parts, strict=True)
        }
        _refuse_masks(tables["infos"])
        playing = [player for player in acting if player not in self._ended]
        for name in ("rewards", "terminations", "truncations"):
            self._require(playing, tables[name], name)
        self._terminated |= self._flagged(tables["terminations"], "terminated")
        self._ended |= self._terminated | self._flagged(tables["truncations"], "truncated")
        observations = tables["observations"]
        continuing = [player for player in playing if player not in self._ended]
        self._require(continuing, observations, "observations")
        # An environment may reuse the array of a player that has left: keep a copy of its last one.
        last = {p: deepcopy(observations[p]) for p in self._ended & observations.keys()}
        self._observations = {**self._observations, **observations, **last}
        rewards = {player: self._reward(player, tables["rewards"]) for player in self.players}
        present = frozenset(self.env.agents)
        entered = present.difference(acting)
        self._terminated -= entered
        self._ended -= entered
        is_over = self._ended >= present
        terminated = is_over and self._terminated.issuperset(self.players)
        truncated = is_over and not terminated
        return EnvironmentStep(self._observations, rewards, terminated, truncated, self._steps)

    def _by_player(self, part: object, name: str) -> Mapping[Player, Data]:
        """Return a returned table after checking its type and its keys."""
        if not isinstance(part, Mapping):
            raise ValueError(f"{name} {when(self._steps)}: {type(part).__name__}, allowed: a dict")
        if name in ("terminations", "truncations"):
            part = expand_all(part, set(self.players) - self._ended)
        if name != "infos":  # RLlib adds keys of its own
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
        for player in players:
            if player not in table:
                hint = (
                    ", allowed: agents that are present from the start" if not self._steps else ""
                )
                raise ValueError(f"{name} {when(self._steps)}: {player!r} is missing{hint}")

    def _flagged(self, flags: Mapping[Player, object], name: str) -> frozenset[Player]:
        """Return the players with a true flag."""
        where = when(self._steps)
        return frozenset(p for p, flag in flags.items() if _flag(flag, f"{name} of {p} {where}"))

    def _reward(self, player: Player, rewards: Mapping[Player, object]) -> float:
        name = f"{describe('reward', player)} {when(self._steps)}"
        return _finite_number(rewards.get(player, 0.0), name)


def expand_all(flags: Mapping[Player, Data], agents: Collection[Player]) -> dict[Player, Data]:
    """Return terminations or truncations without the key ``__all__`` of RLlib.

    If its value is true, it replaces the flags of all `agents`. If it is false, agents without a
    flag continue.

    Examples
    --------
    >>> expand_all({"a": False, "__all__": True}, ["a", "b"])
    {'a': True, 'b': True}
    """
    if ALL not in flags or ALL in agents:
        return dict(flags)
    own = {agent: flag for agent, flag in flags.items() if agent != ALL}
    everyone = dict.fromkeys(agents, flags[ALL])
    return own | everyone if _flag(flags[ALL], ALL) else everyone | own


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
        return PettingZooSimulator(aec_to_parallel(env))
    if isinstance(env, ParallelEnv) or hasattr(env, "possible_agents"):
        return PettingZooSimulator(env)
    if not (hasattr(env, "observation_space") and hasattr(env, "step")):
        name = type(env).__name__
        raise ValueError(f"is {name}, allowed: an environment of Gymnasium or PettingZoo")
    return GymnasiumSimulator(env)


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


def _finite_number(value: object, name: str) -> float:
    """Return a reward as a float.

    Examples
    --------
    >>> _finite_number(np.array([[2.0]], np.float32), "reward")
    2.0
    """
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf" or not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r:.40}, allowed: one finite number")
    return float(array.item())


def _flag(value: object, name: str) -> bool:
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "biuf":
        raise ValueError(f"{name} = {value!r:.40}, allowed: true or false")
    return bool(array.item())


def _refuse_masks(infos: Mapping[Player, object]) -> None:
    for player, info in infos.items():
        for key in MASK_KEYS:
            if isinstance(info, Mapping) and key in info:
                raise mask_error(player, f"info has {key}")


def mask_error(player: Player, where: str) -> ValueError:
    """Return the error that action masks are not supported."""
    return ValueError(
        f"{describe('actions', player)}: {where}, allowed: environments without action masks; "
        "wrap yours so that an illegal action does something legal, and drop the mask"
    )
