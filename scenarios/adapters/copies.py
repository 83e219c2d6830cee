"""Copies of simulators, which are stepped to predict the outcome of joint actions.

A MuJoCo simulator saves its ``MjData``, is stepped itself, and is restored. Others are pickled
without their spaces and windows. Both kinds of copy continue with the random numbers of the
original.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
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


Copies = Callable[[], AbstractContextManager[Simulator]]
"""A saved state of a simulator, valid until its next step: opens a simulator in that state."""


def copy_simulator(simulator: Simulator) -> Copies:
    """Save the present state of a simulator."""
    data = getattr(simulator.env.unwrapped, "data", None)
    is_mujoco = type(data).__module__.partition(".")[0] == "mujoco"
    return _mujoco_copies(simulator) if is_mujoco else _pickled_copies(simulator)


def _pickled_copies(simulator: Simulator) -> Copies:
    """Return copies by pickling; layers and shared objects are stored by their identity."""
    layers = _layers(simulator)
    shared: dict[int, Any] = {id(layer): layer for layer in layers}

    def identity(value: object) -> int | None:
        package = type(value).__module__.partition(".")[0]
        if isinstance(value, SHARED_TYPES) or package in SHARED_PACKAGES:
            shared[id(value)] = value
        return id(value) if id(value) in shared else None

    file = BytesIO()
    pickler: Any = pickle.Pickler(file, pickle.HIGHEST_PROTOCOL)
    pickler.persistent_id = identity
    # By attribute, because environments that inherit EzPickle would be constructed again.
    pickler.dump([vars(layer) for layer in layers])
    saved = file.getvalue()

    @contextmanager
    def copies() -> Iterator[Simulator]:
        copied: dict[int, Any] = {id(layer): object.__new__(type(layer)) for layer in layers}
        unpickler: Any = pickle.Unpickler(BytesIO(saved))
        unpickler.persistent_load = (shared | copied).__getitem__
        for layer, attributes in zip(copied.values(), unpickler.load(), strict=True):
            vars(layer).update(attributes)
        yield copied[id(simulator)]

    return copies


def _mujoco_copies(simulator: Simulator) -> Copies:
    """Return the simulator itself, which is restored after use."""
    mujoco: Any = import_module("mujoco")
    env = simulator.env.unwrapped
    attributes = [(layer, dict(vars(layer))) for layer in _layers(simulator)]
    saved = mujoco.MjData(env.model)
    mujoco.mj_copyData(saved, env.model, env.data)

    @contextmanager
    def copies() -> Iterator[Simulator]:
        try:
            yield simulator
        finally:
            mujoco.mj_copyData(env.data, env.model, saved)
            for layer, values in attributes:
                vars(layer).update(values)

    return copies


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
            with copies() as copied:
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
