"""Construction of environments: registered ids, modules and users' files."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import gymnasium
import pettingzoo
from pettingzoo import AECEnv, ParallelEnv

from ...core.plugins import sources
from ...core.plugins.origin import checked_origin
from ...core.plugins.trust import is_module_name, modules_in
from ...core.plugins.words import near
from .settings import EnvironmentSettings, GymnasiumSettings
from .simulators import GymnasiumSimulator, Simulator, make_simulator


@dataclass(frozen=True)
class Maker:
    """Makes simulators of one environment.

    Makers with equal settings and the same creator are equal, so that inspections are cached.
    """

    settings: EnvironmentSettings
    """Settings with the id and the options of the environment."""
    creator: Callable[..., object] | None = None
    """Class or function that makes the environment; None for a registered id or a module."""

    def __call__(self, render_mode: str | None = None) -> Simulator:
        """Return the simulator of a new environment.

        Raises
        ------
        ValueError
            If the environment cannot be made or is of another kind.
        """
        settings = self.settings
        is_gymnasium = isinstance(settings, GymnasiumSettings)
        options = dict(settings.options)
        if render_mode is not None:
            options["render_mode"] = render_mode
        try:
            if self.creator is not None:
                env = self.creator(**options)
            elif is_gymnasium:
                env = _make_gymnasium(settings.id, options)
            else:
                env = _make_pettingzoo(settings.id, options)
            simulator = make_simulator(env)
            if isinstance(simulator, GymnasiumSimulator) != is_gymnasium:
                other = "pettingzoo" if is_gymnasium else "gymnasium"
                raise ValueError(f"its environment is one of scenario.kind = {other!r}")
        except Exception as error:  # raised by the environment
            is_missing = isinstance(error, ImportError | gymnasium.error.DependencyNotInstalled)
            hint = " (nested-agents has the extras mpe and mujoco)" if is_missing else ""
            problem = f"cannot be made, {sources.format_error(error)}{hint}"
            raise ValueError(f"{self.name}: {problem}") from None
        return simulator

    @property
    def name(self) -> str:
        """The environment in messages."""
        return f"scenario.id = {self.settings.id!r}" if self.settings.id else "the environment"


def find_maker(settings: EnvironmentSettings) -> Maker:
    """Return the maker of an environment, from a user's file or by its id.

    Raises
    ------
    ValueError
        If the file cannot be run or lacks the name, or a module is not trusted.
    """
    try:
        if sources.is_reference(settings.id) or settings.id.endswith(".py"):
            loaded = sources.active().load(settings.id)
            kinds = gymnasium.Env, AECEnv, ParallelEnv
            return Maker(settings, checked_origin(settings.id, loaded, "environment", *kinds))
        for name, _ in modules_in({"id": settings.id, "options": settings.options}):
            sources.active().permit(name)
    except ValueError as error:
        raise ValueError(f"scenario.id = {settings.id!r}: {error}") from None
    return Maker(settings)


def _make_gymnasium(name: str, options: dict[str, Any]) -> object:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".*the latest versioned environment")
        env: gymnasium.Env[object, object] = gymnasium.make(
            name, disable_env_checker=True, **options
        )
    if env.spec and env.spec.id != name.rpartition(":")[2]:
        raise ValueError(f"name a version, such as {env.spec.id}")
    return env


def _make_pettingzoo(name: str, options: dict[str, Any]) -> object:
    """Return an environment by its registered id, ``module:id``, or a module that makes it."""
    module, _, registered = name.rpartition(":")
    if module:
        import_module(module)
    if registered in pettingzoo.parallel_registry:
        return pettingzoo.make("parallel", registered, **options)
    if registered in pettingzoo.aec_registry:
        return pettingzoo.make("aec", registered, **options)
    path = name.replace("/", ".")
    if not is_module_name(path):
        hint = near(registered, [*pettingzoo.parallel_registry, *pettingzoo.aec_registry])
        raise ValueError(
            f"is not registered with PettingZoo, and is no module; {hint}".removesuffix("; ")
        )
    made = vars(import_module(path))
    creator = made["parallel_env"] if "parallel_env" in made else made["env"]
    return creator(**options)
