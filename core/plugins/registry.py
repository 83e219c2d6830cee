"""Registries: everything that a user would vary, by name.

Each kind of thing has one registry. A thing gets in

1. by a line in the registry's own table (built in);
2. by an entry point of an installed package, in the group ``nested_agents.KIND``;
3. by a name such as ``"arm.py:Arm"``, relative to the spec that says it;
4. as the object itself, from Python: it becomes the name of where it is defined.

What has settings is in a registry of their models, see `plugged`.
"""

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from . import sources
from .messages import closest


class Registry:
    """The things of one kind, by name.

    Parameters
    ----------
    kind
        What they are called in messages, and in the name of the entry-point group.
    built_in
        By name where each is, as ``"package.module:Name"``; imported when it is asked for.
    moved
        By names of earlier versions, what is written in their place.

    Examples
    --------
    >>> numbers = Registry("number", {"pi": "math:pi"})
    >>> numbers.find("pi"), numbers.names()
    (3.141592653589793, ['pi'])
    """

    def __init__(
        self, kind: str, built_in: Mapping[str, str], moved: Mapping[str, str] | None = None
    ) -> None:
        self.kind = kind
        self.built_in = dict(built_in)
        self.moved = moved or {}

    @property
    def group(self) -> str:
        """The entry-point group under which installed packages offer things of this kind.

        >>> Registry("state variable", {}).group
        'nested_agents.state_variables'
        """
        plural = self.kind[:-1] + "ies" if self.kind.endswith("y") else self.kind + "s"
        return f"nested_agents.{plural.replace(' ', '_')}"

    def installed(self) -> dict[str, str]:
        """Return what installed packages offer: by name where it is.

        Raises
        ------
        ValueError
            If a name is offered twice, or is a built-in one.
        """
        from importlib.metadata import entry_points

        places: dict[str, str] = {}
        for point in entry_points(group=self.group):
            known = self.built_in.get(point.name) or places.get(point.name)
            if known is not None and known != point.value:
                raise ValueError(f"{point.name!r} is offered twice: {known}, {point.value}")
            places[point.name] = point.value
        return places

    def names(self) -> list[str]:
        """Return the names of all that is built in or installed."""
        return [*self.built_in, *self.installed()]

    def find(self, name: str) -> Any:
        """Return a thing by its name, or by where it is.

        Raises
        ------
        ValueError
            If there is none, or it cannot be loaded; one line.
        """
        if sources.is_reference(name):
            return sources.active().load(name)
        place = self.built_in.get(name) or self.installed().get(name)
        if place is None and ":" in name and "." in name.partition(":")[0]:
            place = name
        if place is None and name in self.moved:
            raise ValueError(self.moved[name])
        if place is None:
            raise ValueError(f"{closest(name, self.names())}, or one of your own as file.py:NAME")
        try:
            return resolve_name(place)
        except Exception as error:
            if name in self.built_in:
                raise
            raise ValueError(f"cannot be loaded: {sources.format_error(error)}") from None

    def reference_to(self, thing: Any) -> str:
        """Return the name of an object: the registered one, or where it is defined.

        Raises
        ------
        ValueError
            If it is defined in no file, as in an interactive session.
        """
        defined = getattr(thing, "function", thing)
        module = sys.modules.get(getattr(defined, "__module__", ""))
        name = str(getattr(defined, "__qualname__", ""))
        if module is None or not name or "<" in name:
            raise ValueError(f"{thing!r} has no name at the top of a file: write it to one")
        if "__source_name__" in vars(module):
            return f"{vars(module)['__source_name__']}:{name}"
        place = f"{module.__name__}:{name}"
        for known, where in {**self.built_in, **self.installed()}.items():
            if where == place:
                return known
        path = getattr(module, "__file__", None)
        if path is None:
            raise ValueError(f"{name} is defined in no file: write it to one")
        if module.__package__ or "site-packages" in Path(path).parts:
            return place
        return f"{_relative(path)}:{name}"


def _relative(path: str) -> str:
    """Return a path as it is written from the working directory."""
    here, there = os.path.realpath(os.getcwd()), os.path.realpath(path)
    return os.path.relpath(there, here) if there.startswith(here + os.sep) else there
