"""Where environments come from: the registries of Gymnasium and PettingZoo, modules, users' files.

A file is run, kept with the study and trusted as all files of users are, see
`nested_agents.core.plugins.sources`.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import gymnasium
from pettingzoo import AECEnv, ParallelEnv

from ...core.plugins import sources
from ...core.plugins.origin import checked_origin
from ...core.plugins.trust import is_module_name, modules_in
from ...core.plugins.words import near
from .settings import AdaptedSettings, GymnasiumSettings
from .simulators import Environment, GymnasiumSimulator, Simulator, simulator_of

ENVIRONMENTS = (gymnasium.Env, AECEnv, ParallelEnv)
"""Classes of environments."""

Make = Callable[[AdaptedSettings, str | None], Simulator]
"""Makes a simulator of settings that renders in a mode of its environment, or does not."""


def maker_of(settings: AdaptedSettings) -> Make:
    """Return what makes the simulators of settings: of a user's file, or by a registered id.

    Raises
    ------
    ValueError
        If a file cannot be run, or has no such name; one line.
    """
    try:
        if sources.is_reference(settings.id) or settings.id.endswith(".py"):
            thing = sources.active().load(settings.id)
            return OfFile(checked_origin(settings.id, thing, "environment", *ENVIRONMENTS))
        module, colon, registered = settings.id.partition(":")
        if colon and (":" in registered or not is_module_name(module)):
            raise ValueError("must be written module:name")
        for named, _ in modules_in({"id": settings.id, "options": settings.options}):
            sources.active().permit(named)
    except ValueError as error:
        raise ValueError(f"scenario.id = {settings.id!r}: {error}") from None
    return make_by_id


@dataclass(frozen=True)
class OfFile:
    """Makes environments by what a user's file has: the same for the same text of the file."""

    creator: Callable[..., object]
    """A function or class that makes an environment."""

    def __call__(self, settings: AdaptedSettings, render_mode: str | None) -> Simulator:
        """Return the simulator of a new environment.

        Raises
        ------
        ValueError
            If it cannot be made, or is of another kind; one line.
        """
        try:
            simulator = simulator_of(self.creator(**_options(settings, render_mode)))
            is_alone = isinstance(simulator, GymnasiumSimulator)
            if is_alone != isinstance(settings, GymnasiumSettings):
                kind = "gymnasium" if is_alone else "pettingzoo"
                raise ValueError(f"its environment is one of scenario.kind = {kind!r}")
        except Exception as error:  # an environment may be anybody's
            raise _unmade(settings, error) from None
        return simulator


def make_by_id(settings: AdaptedSettings, render_mode: str | None) -> Simulator:
    """Return the simulator of an environment that Gymnasium or PettingZoo knows, or a module makes.

    Raises
    ------
    ValueError
        If it cannot be made; one line.
    """
    options = _options(settings, render_mode)
    try:
        if isinstance(settings, GymnasiumSettings):
            return simulator_of(_of_gymnasium(settings.id, options))
        return simulator_of(_creator_of_pettingzoo(settings.id)(**options))
    except Exception as error:  # an environment may be anybody's
        raise _unmade(settings, error) from None


def _options(settings: AdaptedSettings, render_mode: str | None) -> Mapping[str, Any]:
    rendering = {} if render_mode is None else {"render_mode": render_mode}
    return {**settings.options, **rendering}


def _unmade(settings: AdaptedSettings, error: Exception) -> ValueError:
    """Return in one line why no environment was made."""
    is_missing = isinstance(error, ImportError | gymnasium.error.DependencyNotInstalled)
    extras = ", extras of nested-agents are mpe and mujoco" if is_missing else ""
    problem = f"cannot be made, {sources.format_error(error)}{extras}"
    return ValueError(f"scenario.id = {settings.id!r}: {problem}")


def _of_gymnasium(name: str, options: Mapping[str, Any]) -> Environment:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".*the latest versioned environment")
        env = gymnasium.make(name, disable_env_checker=True, **options)
    if env.spec and env.spec.id != name.rpartition(":")[2]:
        raise ValueError(f"say which version, such as {env.spec.id}")
    return env


def _creator_of_pettingzoo(name: str) -> Callable[..., object]:
    """Return what makes an environment of PettingZoo, registered or a module's."""
    importing, _, registered = name.rpartition(":")
    if importing:  # as Gymnasium has it: a module that registers it
        import_module(importing)
    creator = _registered(registered)
    if creator is not None:
        return creator
    path = name.replace("/", ".")
    if not is_module_name(path):
        raise ValueError("must be written module:name, or as a module")
    module = import_module(path)
    of_module: Callable[..., object] = getattr(module, "parallel_env", None) or module.env
    return of_module


def _registered(name: str) -> Callable[..., object] | None:
    """Return what makes a registered environment; PettingZoo's own modules are registered, too."""
    try:
        from pettingzoo import aec_registry, make, parallel_registry
    except ImportError:  # versions before 1.26 have no registries
        return None
    own = name.replace(".", "/").removeprefix("pettingzoo/")
    for known in (name, re.sub(r"_v(?=\d+$)", "-v", own)):
        if known in parallel_registry:
            return partial(make, "parallel", known)
        if known in aec_registry:
            return partial(make, "aec", known)
    if re.search(r"-v\d+$", name):  # no module is called so
        hint = near(name, [*parallel_registry, *aec_registry])
        raise ValueError(f"PettingZoo has registered no such id; {hint}".removesuffix("; "))
    return None
