"""Copies of a simulator, which are stepped to predict what joint actions lead to.

A simulator of MuJoCo is saved by its ``MjData``, played and brought back: what its environment
makes of that, observations and rewards, is its own. Others are saved as Python objects, without
spaces and windows, and made anew of that. Either way a copy has the random numbers of the original.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from io import BytesIO
from types import FunctionType, ModuleType
from typing import Any

import gymnasium

from ...core.plugins.sources import format_error
from .simulators import Simulator

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
        file = BytesIO()
        pickler = _Pickler(file, self._layers)
        # Attribute by attribute: many environments (EzPickle) would be made anew.
        pickler.dump([vars(layer) for layer in self._layers])
        self._saved, self._shared = file.getvalue(), pickler.shared

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return a copy."""
        made = {id(layer): object.__new__(type(layer)) for layer in self._layers}
        unpickler = _Unpickler(BytesIO(self._saved), {**self._shared, **made})
        for layer, attributes in zip(made.values(), unpickler.load(), strict=True):
            vars(layer).update(attributes)
        yield made[id(self._layers[0])]


class _Pickler(pickle.Pickler):
    """Leaves out what copies share, and the layers themselves."""

    def __init__(self, file: BytesIO, layers: list[Any]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self.shared: dict[int, Any] = {id(layer): layer for layer in layers}

    def persistent_id(self, value: Any) -> int | None:
        """Return the identity of what is left out."""
        if id(value) not in self.shared:
            if not _is_shared(value):
                return None
            self.shared[id(value)] = value
        return id(value)


class _Unpickler(pickle.Unpickler):
    """Puts in what was left out."""

    def __init__(self, file: BytesIO, shared: Mapping[int, Any]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, key: int) -> Any:
        """Return what has the identity `key`."""
        return self._shared[key]


class SavedMujoco:
    """The simulator itself, brought back afterwards.

    Parameters
    ----------
    simulator
        The original, an environment of MuJoCo.
    """

    def __init__(self, simulator: Simulator) -> None:
        mujoco: Any = import_module("mujoco")
        self._simulator, self._env = simulator, _unwrapped(simulator)
        self._attributes = [(layer, dict(vars(layer))) for layer in _layers(simulator)]
        self._copy, self._saved = mujoco.mj_copyData, mujoco.MjData(self._env.model)
        self._copy(self._saved, self._env.model, self._env.data)

    @contextmanager
    def lane(self) -> Iterator[Simulator]:
        """Return the simulator, which is where it was when the context ends."""
        try:
            yield self._simulator
        finally:
            self._copy(self._env.data, self._env.model, self._saved)
            for layer, values in self._attributes:
                vars(layer).update(values)


def _unwrapped(simulator: Simulator) -> Any:
    return simulator.env.unwrapped


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
