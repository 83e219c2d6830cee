"""Environments of Gymnasium and PettingZoo in one form: players that act and observe.

A player acts and observes: the one of Gymnasium, an agent of PettingZoo. Who has left an episode
before its end observes what it last observed, and is paid nothing.

Copies of a simulator are stepped to predict what joint actions lead to. A simulator of MuJoCo is
saved by its ``MjData``, played and brought back: what its environment makes of that, observations
and rewards, is its own. Others are saved as Python objects, without spaces and windows, and made
anew of that. Either way a copy has the random numbers of the original.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from io import BytesIO
from types import FunctionType, ModuleType
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


SHARED = ("pygame", "glfw", "OpenGL", "moderngl")
"""Packages whose objects a simulator draws with; copies have them in common."""


def copies_of(simulator: Simulator) -> PickledCopies | SavedMujoco:
    """Return what makes copies of a simulator as it is now, by ``lane``, until its next step."""
    data = getattr(simulator.env.unwrapped, "data", None)
    is_mujoco = type(data).__module__.partition(".")[0] == "mujoco"
    return SavedMujoco(simulator) if is_mujoco else PickledCopies(simulator)


class PickledCopies:
    """Copies of Python objects.

    Parameters
    ----------
    simulator
        The original.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._layers = list(_layers(simulator))
        self._kept: dict[int, Any] = {id(layer): layer for layer in self._layers}
        file = BytesIO()
        pickler: Any = pickle.Pickler(file, pickle.HIGHEST_PROTOCOL)
        pickler.persistent_id = self._identity
        # Attribute by attribute: many environments (EzPickle) would be made anew.
        pickler.dump([vars(layer) for layer in self._layers])
        self._saved = file.getvalue()

    def _identity(self, value: Any) -> int | None:
        """Return the identity of what copies have in common, and of the layers themselves."""
        if id(value) not in self._kept:
            if not _is_shared(value):
                return None
            self._kept[id(value)] = value
        return id(value)

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return a copy."""
        made = {id(layer): object.__new__(type(layer)) for layer in self._layers}
        unpickler: Any = pickle.Unpickler(BytesIO(self._saved))
        unpickler.persistent_load = {**self._kept, **made}.__getitem__
        for layer, attributes in zip(made.values(), unpickler.load(), strict=True):
            vars(layer).update(attributes)
        yield made[id(self._layers[0])]


class SavedMujoco:
    """The simulator itself, brought back afterwards.

    Parameters
    ----------
    simulator
        The original, an environment of MuJoCo.
    """

    def __init__(self, simulator: Simulator) -> None:
        mujoco: Any = import_module("mujoco")
        env: Any = simulator.env.unwrapped
        self._simulator, self._env = simulator, env
        self._attributes = [(layer, dict(vars(layer))) for layer in _layers(simulator)]
        self._copy, self._saved = mujoco.mj_copyData, mujoco.MjData(env.model)
        self._copy(self._saved, env.model, env.data)

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return the simulator, which is where it was when the context ends."""
        try:
            yield self._simulator
        finally:
            self._copy(self._env.data, self._env.model, self._saved)
            for layer, values in self._attributes:
                vars(layer).update(values)


def fault_of_copies(simulator: Simulator, actions: Mapping[str, Any]) -> str:
    """Return why a simulator cannot be copied, in words; nothing if it can.

    It is started and played for some steps. Then two copies and itself must do the same.
    """
    simulator.reset(0)
    for _ in range(2):
        simulator.step(actions)
    played = []
    try:
        copies = copies_of(simulator)
        for _ in range(2):
            with copies.lane() as lane:
                played.append(pickle.dumps([lane.step(actions) for _ in range(2)]))
    except Exception as error:  # an environment may be anybody's
        return format_error(error)
    played.append(pickle.dumps([simulator.step(actions) for _ in range(2)]))
    return "" if len(set(played)) == 1 else "a copy does something else than the original"


def _layers(simulator: Simulator) -> Iterator[Any]:
    """Yield a simulator and all that its environment is wrapped in, from the outside in."""
    layer: Any = simulator
    while layer is not None:
        yield layer
        inside = vars(layer)
        layer = inside.get("env", inside.get("aec_env"))


def _is_shared(value: Any) -> bool:
    """Return whether no step changes a part of an environment."""
    fixed = gymnasium.Space, gymnasium.envs.registration.EnvSpec, FunctionType, ModuleType
    return isinstance(value, fixed) or type(value).__module__.partition(".")[0] in SHARED
