"""Copies of simulators, which are stepped to predict the outcome of joint actions.

A MuJoCo simulator saves its ``MjData``, is stepped itself, and is restored. Others are pickled
without their spaces and windows. Both kinds of copy continue with the random numbers of the
original.
"""

from __future__ import annotations

import pickle
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from importlib import import_module
from io import BytesIO
from types import FunctionType, ModuleType
from typing import Any

import gymnasium

from ...core.plugins.sources import format_error
from .simulators import Player, Simulator

SHARED_PACKAGES = ("pygame", "glfw", "OpenGL", "moderngl")
"""Packages of objects that a simulator and its copies share."""
SHARED_TYPES = gymnasium.Space, gymnasium.envs.registration.EnvSpec, FunctionType, ModuleType
"""Types of objects that no step changes, which are shared, too."""


class SimulatorCopies(ABC):
    """A saved state of a simulator, valid until the simulator's next step."""

    @abstractmethod
    def open(self) -> AbstractContextManager[Simulator]:
        """Return a context with a simulator in the saved state."""


def copy_simulator(simulator: Simulator) -> SimulatorCopies:
    """Save the present state of a simulator."""
    data = getattr(simulator.env.unwrapped, "data", None)
    is_mujoco = type(data).__module__.partition(".")[0] == "mujoco"
    return MujocoCopies(simulator) if is_mujoco else PickledCopies(simulator)


class PickledCopies(SimulatorCopies):
    """Copies by pickling."""

    def __init__(self, simulator: Simulator) -> None:
        self._layers = _layers(simulator)
        file = BytesIO()
        pickler = _Pickler(file, self._layers)
        # By attribute, because environments that inherit EzPickle would be constructed again.
        pickler.dump([vars(layer) for layer in self._layers])
        self._shared = pickler.shared
        self._saved = file.getvalue()

    @contextmanager
    def open(self) -> Iterator[Simulator]:
        """Return a context with a new copy."""
        copies: dict[int, Any] = {id(layer): object.__new__(type(layer)) for layer in self._layers}
        unpickler = _Unpickler(BytesIO(self._saved), self._shared | copies)
        for layer, attributes in zip(copies.values(), unpickler.load(), strict=True):
            vars(layer).update(attributes)
        yield copies[id(self._layers[0])]


class _Pickler(pickle.Pickler):
    """Pickles only the identity of the layers themselves and of shared objects."""

    def __init__(self, file: BytesIO, layers: Iterable[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self.shared: dict[int, object] = {id(layer): layer for layer in layers}

    def persistent_id(self, value: object, /) -> int | None:
        """Return the identity of a shared object; None for objects to be pickled."""
        package = type(value).__module__.partition(".")[0]
        if isinstance(value, SHARED_TYPES) or package in SHARED_PACKAGES:
            self.shared[id(value)] = value
        return id(value) if id(value) in self.shared else None


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: BytesIO, shared: Mapping[int, object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, identity: int, /) -> object:
        """Return a shared object."""
        return self._shared[identity]


class MujocoCopies(SimulatorCopies):
    """The MuJoCo simulator itself, restored after use."""

    def __init__(self, simulator: Simulator) -> None:
        mujoco: Any = import_module("mujoco")
        env = simulator.env.unwrapped
        self._simulator = simulator
        self._env = env
        self._attributes = [(layer, dict(vars(layer))) for layer in _layers(simulator)]
        self._copy_data = mujoco.mj_copyData
        self._saved = mujoco.MjData(env.model)
        self._copy_data(self._saved, env.model, env.data)

    @contextmanager
    def open(self) -> Iterator[Simulator]:
        """Return a context with the simulator; its end restores the saved state."""
        try:
            yield self._simulator
        finally:
            self._copy_data(self._env.data, self._env.model, self._saved)
            for layer, values in self._attributes:
                vars(layer).update(values)


def find_copy_fault(simulator: Simulator, actions: Mapping[Player, object]) -> str:
    """Return the reason why a simulator cannot be copied; empty if it can.

    The simulator is reset and stepped. Two copies and the original must then do the same.
    """
    simulator.reset(0)
    for _ in range(2):
        simulator.step(actions)
    results = []
    try:
        copies = copy_simulator(simulator)
        for _ in range(2):
            with copies.open() as copied:
                results.append(pickle.dumps([copied.step(actions) for _ in range(2)]))
    except Exception as error:  # raised by the environment
        return format_error(error)
    results.append(pickle.dumps([simulator.step(actions) for _ in range(2)]))
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
