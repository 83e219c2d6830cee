"""Copies of a simulator, which are stepped to predict what joint actions lead to.

A simulator of MuJoCo is saved by its ``MjData``, played and brought back: what its environment
makes of that, observations and rewards, is its own. Others are copied as Python objects, without
spaces and windows. Either way a copy has the random numbers of the original, too.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from importlib import import_module
from typing import Any

import gymnasium

from ...core.plugins.sources import format_error
from .simulators import Simulator

SHARED = ("pygame", "glfw", "OpenGL", "moderngl")
"""Packages whose objects a simulator draws with; copies have them in common."""


def copies_of(simulator: Simulator) -> DeepCopies | SavedMujoco:
    """Return what copies a simulator: its ``lane`` is one that is where the original is now."""
    data = getattr(simulator.env.unwrapped, "data", None)
    is_mujoco = type(data).__module__.partition(".")[0] == "mujoco"
    return SavedMujoco(simulator) if is_mujoco else DeepCopies(simulator)


class DeepCopies:
    """Copies as Python objects.

    Parameters
    ----------
    simulator
        The original.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return a copy."""
        layers = list(_layers(self._simulator))
        fixed = (v for layer in layers for v in vars(layer).values() if _is_shared(v))
        memo: dict[int, Any] = {id(value): value for value in fixed}
        # Attribute by attribute: many environments (EzPickle) would be made anew.
        copies = [object.__new__(type(layer)) for layer in layers]
        memo |= {id(layer): made for layer, made in zip(layers, copies, strict=True)}
        for layer, made in zip(layers, copies, strict=True):
            vars(made).update(deepcopy(vars(layer), memo))
        yield copies[0]


class SavedMujoco:
    """The simulator itself, brought back afterwards.

    Parameters
    ----------
    simulator
        The original, an environment of MuJoCo.
    """

    def __init__(self, simulator: Simulator) -> None:
        mujoco: Any = import_module("mujoco")
        self._simulator = simulator
        self._copy = mujoco.mj_copyData
        env: Any = simulator.env.unwrapped
        self._saved = mujoco.MjData(env.model)

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return the simulator, which is where it was when the context ends."""
        env: Any = self._simulator.env.unwrapped
        attributes = [(layer, dict(vars(layer))) for layer in _layers(self._simulator)]
        self._copy(self._saved, env.model, env.data)
        try:
            yield self._simulator
        finally:
            self._copy(env.data, env.model, self._saved)
            for layer, values in attributes:
                vars(layer).update(values)


def fault_of_copies(simulator: Simulator, actions: Mapping[str, Any]) -> str:
    """Return why a simulator cannot be copied, in words; nothing if it can.

    It is started and played for some steps. Then two copies and itself must do the same.
    """
    simulator.reset(0)
    for _ in range(2):
        simulator.step(actions)
    copies, played = copies_of(simulator), []
    try:
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
    if isinstance(value, dict):
        return bool(value) and all(isinstance(part, gymnasium.Space) for part in value.values())
    is_fixed = isinstance(value, gymnasium.Space | gymnasium.envs.registration.EnvSpec)
    return is_fixed or type(value).__module__.partition(".")[0] in SHARED
