"""Registries of everything that a spec can name.

Each kind of thing has one registry. A thing is registered

1. by a line in the registry's own table (built in);
2. by an entry point of an installed package in the group ``nested_agents.KIND``;
3. by a name such as ``"arm.py:Arm"``, relative to the spec;
4. as the object itself, from Python, which is converted to the name of its definition.

Things with settings are in a registry of *settings models*; the method `build` of a model makes the
thing. A user's class has a nested ``Settings`` and is built from them. A function is called with
the settings as its annotated keyword-only parameters; its docstring documents them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from functools import cache
from inspect import getdoc, signature, unwrap
from pathlib import Path
from pkgutil import resolve_name
from types import FunctionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import Field, create_model

from . import sources
from .origin import checked_origin
from .settings import PartSettings, Settings
from .trust import module_named
from .words import closest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

MEANING = re.compile(r"^(\w+)\n((?:    .*\n?)+)", re.MULTILINE)
"""A parameter in a docstring: its name, and its indented description."""


@cache
def _offered(
    entry_points: Callable[..., EntryPoints], group: str, folders: tuple[str, ...]
) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group; cached by the folders of packages, which are many."""
    return tuple(entry_points(group=group))


class Registry:
    """Things of one kind by name.

    Parameters
    ----------
    kind
        Name of the kind in messages and in the entry-point group.
    built_in
        Place of each thing by name, as ``"package.module:Name"``; imported on first use.
    moved
        Message for each name that has moved elsewhere.

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
        """Return the places of the things of installed packages by name.

        Raises
        ------
        ValueError
            If a name is offered twice, or is a built-in one.
        """
        from importlib.metadata import entry_points

        places: dict[str, str] = {}
        for point in _offered(entry_points, self.group, tuple(sys.path)):
            known = self.built_in.get(point.name) or places.get(point.name)
            if known is not None and known != point.value:
                raise ValueError(f"{point.name!r} is offered twice: {known}, {point.value}")
            places[point.name] = point.value
        return places

    def names(self) -> list[str]:
        """Return the names of all built-in and installed things."""
        return [*self.built_in, *self.installed()]

    def find(self, name: str) -> Any:
        """Return a thing by its name or place.

        Raises
        ------
        ValueError
            If there is none, or it cannot be loaded; one line.
        """
        if sources.is_reference(name):
            return sources.active().load(name)
        place = self.built_in.get(name)
        if place is None and (place := self.installed().get(name)) is not None:
            sources.active().offered_by(place.partition(":")[0])
        if place is None:
            module = module_named(name)
            if "." not in module:
                unknown = f"{closest(name, self.names())}, or one of your own as file.py:NAME"
                raise ValueError(self.moved.get(name, unknown))
            sources.active().permit(module)
        try:
            return resolve_name(place or name)
        except Exception as error:
            if name in self.built_in:
                raise
            raise ValueError(f"cannot be loaded: {sources.format_error(error)}") from None

    def reference_to(self, thing: object) -> str:
        """Return the registered name of an object, or the place of its definition.

        Raises
        ------
        ValueError
            If it is defined in no file, as in an interactive session.
        """
        function: Any = getattr(thing, "function", thing)  # that of a state variable
        defined = unwrap(function)
        is_named = isinstance(defined, type | FunctionType) and "<" not in defined.__qualname__
        module = sys.modules.get(defined.__module__) if is_named else None
        if module is None:
            raise ValueError(
                f"{thing!r} is not defined at the top level of a file; define it there"
            )
        name = defined.__qualname__
        if file := sources.file_of_module(module.__name__):
            return f"{file}:{name}"
        place = f"{module.__name__}:{name}"
        for known, where in {**self.built_in, **self.installed()}.items():
            if where == place:
                return known
        path = getattr(module, "__file__", None)
        if path is None:
            raise ValueError(f"{name} is defined in an interactive session; save it to a file")
        if module.__package__ or "site-packages" in Path(path).parts:
            return place
        here, there = Path().resolve(), Path(path).resolve()
        return f"{there.relative_to(here) if there.is_relative_to(here) else there}:{name}"


class SettingsRegistry(Registry):
    """Things of a kind that have settings, selected by ``kind`` in a table.

    Parameters
    ----------
    kind, built_in, moved
        As of `Registry`.
    base
        Base class of the settings of users' classes.
    root
        Base class of all settings of this kind. By default, `base`.
    function_base
        Place of the base class of the settings of users' functions. By default, `base`.

    Examples
    --------
    A user's class has nested settings and is built from them:

    >>> class Cart:
    ...     class Settings(PartSettings):
    ...         wheels: int = 2
    ...     def __init__(self, settings):
    ...         self.wheels = settings.wheels
    >>> carts = SettingsRegistry("cart", {}, PartSettings)
    >>> carts.model_of("cart", Cart)(wheels=4).build().wheels
    4
    """

    def __init__(
        self,
        kind: str,
        built_in: Mapping[str, str],
        base: type[PartSettings],
        root: type[PartSettings] | None = None,
        moved: Mapping[str, str] | None = None,
        function_base: str = "",
    ) -> None:
        super().__init__(kind, built_in, moved)
        self.base = base
        self.function_base = function_base
        self.root = root or base
        self._models: dict[tuple[str, int], tuple[object, type[PartSettings]]] = {}

    def model(self, name: str) -> type[PartSettings]:
        """Return the settings model of a thing by its name or place.

        Raises
        ------
        ValueError
            If there is none, or it is not of this kind; one line.
        """
        return self.model_of(name, self.find(name))

    def model_of(self, name: str, thing: object) -> type[PartSettings]:
        """Return the settings model of a thing, with the ``kind`` `name`.

        Raises
        ------
        ValueError
            If it is neither settings of this kind, nor a class with such settings, nor a function.
        """
        if name in self.built_in and isinstance(thing, type) and issubclass(thing, PartSettings):
            return thing
        key = name, id(thing)
        if key not in self._models:
            self._models[key] = thing, self._new_model(name, thing)
        return self._models[key][1]

    def _new_model(self, name: str, thing: object) -> type[PartSettings]:
        thing = checked_origin(name, thing, self.kind, self.root)
        is_class = isinstance(thing, type)
        settings: object = resolve_name(self.function_base) if self.function_base else self.base
        if isinstance(thing, type):
            settings = thing if issubclass(thing, self.root) else getattr(thing, "Settings", None)
        if not (isinstance(settings, type) and issubclass(settings, self.root)):
            base = f"{self.base.__module__}.{self.base.__qualname__}"
            raise ValueError(f"is no {self.kind}: it needs a class Settings that inherits {base}")
        derived = create_model(
            settings.__qualname__,
            __base__=settings,
            __module__=settings.__module__,
            __doc__=settings.__doc__ if is_class else thing.__doc__,
            kind=(cast(Any, Literal[name]), name),
            **({} if is_class else _parameters(thing)),
        )
        model = cast(Any, derived)
        if settings is not thing:
            model.factory = staticmethod(self._factory(name, thing))
            model.build = PartSettings.build  # evaluators have their own
        return cast(type[PartSettings], model)

    def _factory(self, name: str, thing: Callable[..., object]) -> Callable[..., object]:
        """Return a function that builds a thing of a user from its settings."""

        def build(settings: Settings, *given: object) -> object:
            if not isinstance(thing, type):
                values = dict(settings)
                return thing(*given, **{key: values[key] for key in _parameters(thing)})
            try:
                signature(thing).bind(settings, *given)
            except TypeError as error:
                raise ValueError(f"{self.kind} {name!r}: {error}") from None
            try:
                return thing(settings, *given)
            except OSError:
                raise
            except Exception as error:
                where = sources.place(error)
                raised = f"{self.kind} {name!r} raises {sources.format_error(error)}"
                if isinstance(error, ValueError):  # its own words
                    raised = f"{sources.message(error)}{',' if where else ''}"
                raise ValueError(f"{raised}{where}") from error

        return build

    def parsed(self, text: str, /, **table: Any) -> Any:
        """Return the settings of a name with the other keys of its table.

        Raises
        ------
        ValueError
            If there is no such thing, or it has settings that must be given.
        """
        return self.model(text)(**table)


def _parameters(thing: Callable[..., Any]) -> dict[str, Any]:
    """Return type and default of each annotated keyword-only parameter of a function, by name.

    The descriptions come from the section "Parameters" of its numpydoc docstring.
    """
    section = getdoc(thing) or ""
    meanings = dict(MEANING.findall(section.partition("Parameters\n----------\n")[2]))
    fields: dict[str, Any] = {}
    for p in signature(thing).parameters.values():  # what is returned may be slow to import
        if p.kind is p.KEYWORD_ONLY and p.annotation is not p.empty:
            is_text = isinstance(p.annotation, str)
            type_ = eval(p.annotation, thing.__globals__) if is_text else p.annotation
            of_type = cast(Any, Annotated)[type_, Field(description=meanings.get(p.name))]
            fields[p.name] = of_type, ... if p.default is p.empty else p.default
    return fields
