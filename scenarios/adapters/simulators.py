"""Environments of Gymnasium and PettingZoo in one form: players, whom a step tells what it did.

A player acts and observes: the one of Gymnasium, an agent of PettingZoo. Who has left an episode
before its end observes what it last observed, and is paid nothing.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

import gymnasium
from pettingzoo import AECEnv
from pettingzoo.utils.conversions import aec_to_parallel

from ...core.plugins.sources import format_error
from .settings import AdaptedSettings, GymnasiumSettings


class Played(NamedTuple):
    """What a step of an environment told, by player."""

    observations: Mapping[str, Any]
    rewards: Mapping[str, float]
    terminated: bool
    truncated: bool


class GymnasiumSimulator:
    """An environment of Gymnasium, of one player.

    Parameters
    ----------
    env
        The environment; `reset` and `step` modify it.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        self.env = env
        self.players = ("",)
        self.observation_spaces = {"": env.observation_space}
        self.action_spaces = {"": env.action_space}

    def reset(self, seed: int) -> Mapping[str, Any]:
        """Start an episode; return what is observed."""
        return {"": self.env.reset(seed=seed)[0]}

    def step(self, actions: Mapping[str, Any]) -> Played:
        """Carry out an action for one step."""
        observed, reward, terminated, truncated, _ = self.env.step(actions[""])
        return Played({"": observed}, {"": float(reward)}, bool(terminated), bool(truncated))


class ParallelSimulator:
    """A parallel environment of PettingZoo.

    Parameters
    ----------
    env
        The environment; `reset` and `step` modify it.
    """

    def __init__(self, env: Any) -> None:
        self.env = env
        self.players = tuple(env.possible_agents)
        self.observation_spaces = {p: env.observation_space(p) for p in self.players}
        self.action_spaces = {p: env.action_space(p) for p in self.players}
        self._observed: dict[str, Any] = {}
        self._terminated: dict[str, bool] = {}

    def reset(self, seed: int) -> Mapping[str, Any]:
        """Start an episode; return what is observed."""
        self._observed = dict(self.env.reset(seed=seed)[0])
        self._terminated = dict.fromkeys(self.players, False)
        return self._observed

    def step(self, actions: Mapping[str, Any]) -> Played:
        """Carry out the actions of those who are still there for one step."""
        acting = {player: actions[player] for player in self.env.agents}
        observed, rewards, terminated, truncated, _ = self.env.step(acting)
        self._observed = {**self._observed, **observed}
        self._terminated = {**self._terminated, **terminated}
        is_over = not self.env.agents or all({**terminated, **truncated}.values())
        has_terminated = all(self._terminated.values())
        paid = {player: float(rewards.get(player, 0.0)) for player in self.players}
        return Played(self._observed, paid, has_terminated, bool(is_over and not has_terminated))


Simulator = GymnasiumSimulator | ParallelSimulator
Make = Callable[[AdaptedSettings, str | None], Simulator]
"""Makes a simulator of settings that renders in a mode of its environment, or does not."""


def make_by_id(settings: AdaptedSettings, render_mode: str | None) -> Simulator:
    """Return the simulator of an environment that Gymnasium knows, or a module of PettingZoo makes.

    Raises
    ------
    ValueError
        If it cannot be made; one line.
    """
    rendering = {} if render_mode is None else {"render_mode": render_mode}
    options = {**settings.options, **rendering}
    try:
        if isinstance(settings, GymnasiumSettings):
            return simulator_of(gymnasium.make(settings.id, disable_env_checker=True, **options))
        module: Any = import_module(settings.id.replace("/", "."))
        return simulator_of((getattr(module, "parallel_env", None) or module.env)(**options))
    except Exception as error:  # an environment may be anybody's
        is_missing = isinstance(error, ImportError | gymnasium.error.DependencyNotInstalled)
        extras = ", extras of nested-agents are mpe and mujoco" if is_missing else ""
        problem = f"cannot be made, {format_error(error)}{extras}"
        raise ValueError(f"scenario.id = {settings.id!r}: {problem}") from None


def simulator_of(env: Any) -> Simulator:
    """Return the simulator of an environment of Gymnasium, or of PettingZoo, parallel or not.

    Raises
    ------
    ValueError
        If its agents do not act in cycles, as those of board games.
    """
    if not hasattr(env, "possible_agents"):
        return GymnasiumSimulator(env)
    if not isinstance(env, AECEnv):
        return ParallelSimulator(env)
    if not env.metadata.get("is_parallelizable", False):
        raise ValueError("its agents act in turns, allowed: those that act at the same time")
    return ParallelSimulator(aec_to_parallel(env))
