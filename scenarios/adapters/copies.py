"""Saved states of simulators, from which joint actions are simulated to predict their outcome."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from importlib import import_module
from io import BytesIO
from types import FunctionType, ModuleType
from typing import Any

import gymnasium

from ...core.plugins.sources import format_error
from .simulators import Player, Simulator

SHARED_PACKAGES = ("pygame", "mujoco")
"""Packages of objects that cannot be pickled."""
SHARED_TYPES = gymnasium.Space, gymnasium.envs.registration.EnvSpec, FunctionType, ModuleType
"""Types of objects that no step changes."""


class SavedState:
    """State of a simulator, including its random numbers, to which it can be restored.

    The attributes of the environment and its wrappers are pickled, except for shared objects. They
    are pickled one by one, because environments that inherit EzPickle would be constructed again.
    A MuJoCo simulation is copied as ``MjData``.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._layers = _layers(simulator)
        self._shared: dict[int, object] = {id(layer): layer for layer in self._layers}
        file = BytesIO()
        pickler = _Pickler(file, self._shared)
        pickler.dump([vars(layer) for layer in self._layers])
        self._attributes = file.getvalue()
        attributes = vars(simulator.env.unwrapped)
        self._data: Any = attributes.get("data")
        self._mujoco: Any = None
        if type(self._data).__module__.startswith("mujoco"):
            self._mujoco = import_module("mujoco")
            self._model = attributes["model"]
            self._saved_data = self._mujoco.MjData(self._model)
            self._mujoco.mj_copyData(self._saved_data, self._model, self._data)

    def restore(self) -> None:
        """Restore the simulator to the saved state."""
        unpickler = _Unpickler(BytesIO(self._attributes), self._shared)
        for layer, attributes in zip(self._layers, unpickler.load(), strict=True):
            vars(layer).clear()
            vars(layer).update(attributes)
        if self._mujoco is not None:
            self._mujoco.mj_copyData(self._data, self._model, self._saved_data)


class _Pickler(pickle.Pickler):
    """Pickles only the identity of shared objects."""

    def __init__(self, file: BytesIO, shared: dict[int, object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._shared = shared

    def persistent_id(self, value: object, /) -> int | None:
        """Return the identity of a shared object; None for objects to be pickled."""
        package = type(value).__module__.partition(".")[0]
        if isinstance(value, SHARED_TYPES) or package in SHARED_PACKAGES:
            self._shared[id(value)] = value
        return id(value) if id(value) in self._shared else None


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: BytesIO, shared: Mapping[int, object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, identity: int, /) -> object:
        """Return a shared object."""
        return self._shared[identity]


def find_copy_fault(simulator: Simulator, actions: Mapping[Player, object]) -> str:
    """Return the reason why a simulator's state cannot be saved; empty if it can.

    The simulator is reset, stepped and saved. After being restored, it must do the same twice.
    """
    simulator.reset(0)
    results = []
    try:
        simulator.step(actions)
        saved = SavedState(simulator)
        for _ in range(3):
            results.append(pickle.dumps([simulator.step(actions) for _ in range(2)]))
            saved.restore()
    except Exception as error:  # raised by the environment
        return format_error(error)
    return "" if len(set(results)) == 1 else "a copy does something else than the original"


def _layers(simulator: Simulator) -> list[object]:
    """Return a simulator, its environment and all that this wraps, from the outside in."""
    layers: list[object] = []
    layer: object = simulator
    while layer is not None:
        layers.append(layer)
        attributes = vars(layer)
        layer = attributes.get("env", attributes.get("aec_env"))
    return layers
