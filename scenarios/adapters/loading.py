"""Construction of environments: registered ids, modules and users' files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import Any

import gymnasium
import pettingzoo
from pettingzoo import AECEnv, ParallelEnv

from ...core.plugins import sources
from ...core.plugins.origin import checked_origin
from ...core.plugins.trust import is_module_name, modules_in
from ...core.plugins.words import near
from ..library_types import Environment
from .settings import EnvironmentSettings, GymnasiumSettings
from .simulators import Simulator, make_simulator

Maker = Callable[[EnvironmentSettings, str | None], Simulator]
"""Makes a simulator from settings and a render mode."""


def find_maker(settings: EnvironmentSettings) -> Maker:
    """Return the maker of an environment, from a user's file or by its registered id.

    Raises
    ------
    ValueError
        If the file cannot be run or lacks the name, or a module is not trusted.
    """
    try:
        if sources.is_reference(settings.id) or settings.id.endswith(".py"):
            loaded = sources.active().load(settings.id)
            kinds = gymnasium.Env, AECEnv, ParallelEnv
            return _maker_of(checked_origin(settings.id, loaded, "environment", *kinds))
        module, colon, registered = settings.id.partition(":")
        if colon and (":" in registered or not is_module_name(module)):
            raise ValueError("must be written module:name")
        for name, _ in modules_in({"id": settings.id, "options": settings.options}):
            sources.active().permit(name)
    except ValueError as error:
        raise ValueError(f"scenario.id = {settings.id!r}: {error}") from None
    return make_registered


@cache
def _maker_of(creator: Callable[..., object]) -> Maker:
    """Return the maker of environments of a class or function in a user's file.

    Creators of the same file content are equal and have one maker, so that results can be cached.
    """
    return partial(_make, creator)


def make_registered(settings: EnvironmentSettings, render_mode: str | None) -> Simulator:
    """Return the simulator of a registered environment, or of one that a module makes."""
    is_gymnasium = isinstance(settings, GymnasiumSettings)
    creator = partial(_make_gymnasium if is_gymnasium else _make_pettingzoo, settings.id)
    return _make(creator, settings, render_mode)


def _make(
    creator: Callable[..., object], settings: EnvironmentSettings, render_mode: str | None
) -> Simulator:
    """Call the creator of an environment; report any failure in one line."""
    options = dict(settings.options)
    if render_mode is not None:
        options["render_mode"] = render_mode
    try:
        simulator = make_simulator(creator(**options))
        kind = "gymnasium" if simulator.is_single else "pettingzoo"
        if (kind == "gymnasium") != isinstance(settings, GymnasiumSettings):
            raise ValueError(f"its environment is one of scenario.kind = {kind!r}")
    except Exception as error:  # raised by the environment
        is_missing = isinstance(error, ImportError | gymnasium.error.DependencyNotInstalled)
        hint = " (nested-agents has the extras mpe and mujoco)" if is_missing else ""
        problem = f"cannot be made, {sources.format_error(error)}{hint}"
        raise ValueError(f"scenario.id = {settings.id!r}: {problem}") from None
    return simulator


def _make_gymnasium(name: str, **options: Any) -> Environment:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".*the latest versioned environment")
        env = gymnasium.make(name, disable_env_checker=True, **options)
    if env.spec and env.spec.id != name.rpartition(":")[2]:
        raise ValueError(f"name a version, such as {env.spec.id}")
    return env


def _make_pettingzoo(name: str, **options: Any) -> object:
    module, _, registered = name.rpartition(":")
    if module:  # as in Gymnasium, a module that registers the id
        import_module(module)
    own = registered.replace(".", "/").removeprefix("pettingzoo/")
    for known in (registered, re.sub(r"_v(?=\d+$)", "-v", own)):
        if known in pettingzoo.parallel_registry:
            return pettingzoo.make("parallel", known, **options)
        if known in pettingzoo.aec_registry:
            return pettingzoo.make("aec", known, **options)
    if re.search(r"-v\d+$", registered):  # no module has such a name
        hint = near(registered, [*pettingzoo.parallel_registry, *pettingzoo.aec_registry])
        raise ValueError(f"is not registered with PettingZoo; {hint}".removesuffix("; "))
    path = name.replace("/", ".")
    if not is_module_name(path):
        raise ValueError("must be written module:name, or as a module")
    loaded = import_module(path)
    creator: Callable[..., object] = getattr(loaded, "parallel_env", None) or loaded.env
    return creator(**options)
