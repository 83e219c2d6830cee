"""Copies of simulators, which are stepped to predict what joint actions lead to.

A simulator of MuJoCo is saved by its ``MjData``, played and brought back: what its environment
makes of that, observations and rewards, is its own. Others are saved as Python objects, without
spaces and windows, and made anew of that. Either way a copy has the random numbers of the original.
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

SHARED = ("pygame", "glfw", "OpenGL", "moderngl")
"""Packages whose objects a simulator draws with; copies have them in common."""


class Copies(ABC):
    """What makes copies of a simulator as it is now, until its next step."""

    @abstractmethod
    def lane(self) -> AbstractContextManager[Simulator]:
        """Return a copy, to be stepped as long as the context lasts."""


def copies_of(simulator: Simulator) -> Copies:
    """Return what makes copies of a simulator as it is now."""
    data = getattr(simulator.env.unwrapped, "data", None)
    is_mujoco = type(data).__module__.partition(".")[0] == "mujoco"
    return SavedMujoco(simulator) if is_mujoco else PickledCopies(simulator)


class PickledCopies(Copies):
    """Copies of Python objects.

    Parameters
    ----------
    simulator
        The original.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._layers = list(_layers(simulator))
        file = BytesIO()
        saver = _Saver(file, self._layers)
        # Attribute by attribute: many environments (EzPickle) would be made anew.
        saver.dump([vars(layer) for layer in self._layers])
        self._shared = saver.kept
        self._saved = file.getvalue()

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return a copy."""
        copies: dict[int, Any] = {id(layer): object.__new__(type(layer)) for layer in self._layers}
        loader = _Loader(BytesIO(self._saved), self._shared | copies)
        for layer, attributes in zip(copies.values(), loader.load(), strict=True):
            vars(layer).update(attributes)
        yield copies[id(self._layers[0])]


class _Saver(pickle.Pickler):
    """Saves, of what copies have in common and of the layers themselves, the identity only."""

    def __init__(self, file: BytesIO, layers: Iterable[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self.kept: dict[int, object] = {id(layer): layer for layer in layers}

    def persistent_id(self, value: object, /) -> int | None:
        """Return the identity of a value of which no copy is made; None of others."""
        if id(value) not in self.kept:
            if not _is_shared(value):
                return None
            self.kept[id(value)] = value
        return id(value)


class _Loader(pickle.Unpickler):
    """Loads what a `_Saver` has saved."""

    def __init__(self, file: BytesIO, kept: Mapping[int, object]) -> None:
        super().__init__(file)
        self._kept = kept

    def persistent_load(self, identity: int, /) -> object:
        """Return the value of an identity."""
        return self._kept[identity]


class SavedMujoco(Copies):
    """The simulator itself, brought back afterwards.

    Parameters
    ----------
    simulator
        The original, an environment of MuJoCo.
    """

    def __init__(self, simulator: Simulator) -> None:
        mujoco: Any = import_module("mujoco")
        env = simulator.env.unwrapped
        self._simulator = simulator
        self._env = env
        self._attributes = [(layer, dict(vars(layer))) for layer in _layers(simulator)]
        self._copy = mujoco.mj_copyData
        self._saved = mujoco.MjData(env.model)
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


def fault_of_copies(simulator: Simulator, actions: Mapping[Player, object]) -> str:
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


def _layers(simulator: Simulator) -> Iterator[object]:
    """Yield a simulator and all that its environment is wrapped in, from the outside in."""
    layer: object = simulator
    while layer is not None:
        yield layer
        inside = vars(layer)
        layer = inside.get("env", inside.get("aec_env"))


def _is_shared(value: object) -> bool:
    """Return whether no step changes a part of an environment."""
    fixed = gymnasium.Space, gymnasium.envs.registration.EnvSpec, FunctionType, ModuleType
    return isinstance(value, fixed) or type(value).__module__.partition(".")[0] in SHARED
