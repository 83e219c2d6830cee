"""How the command line reads numbers, paths and texts, for every command alike.

An argument that may be left out reads as one that may not: that it may is told by its default.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import Any

from tyro.conf import UseAppendAction
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo


def registry() -> ConstructorRegistry:
    """Return the rules by which the parser reads arguments."""
    rules = ConstructorRegistry()
    rules.primitive_rule(_rule)
    return rules


def whole(text: str) -> int:
    """Read a whole number.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{quote(text)}: must be a whole number") from None


def present(text: str) -> str:
    """Return a text that is not empty, as that of an unset shell variable is.

    Raises
    ------
    ValueError
        If it is.
    """
    if not text:
        raise ValueError("'': must not be empty")
    return text


READERS: dict[type, tuple[str, Callable[[str], Any]]] = {
    int: ("INT", whole),
    str: ("STR", present),
    Path: ("PATH", lambda text: Path(present(text))),
}
"""What the help calls the value of a type, and how it is read."""


def _rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    if info.type == tuple[str, ...] and UseAppendAction not in info.markers:
        return PrimitiveConstructorSpec(
            nargs="*",
            metavar="STR ...",
            instance_from_str=lambda texts: tuple(present(text) for text in texts),
            is_instance=lambda value: isinstance(value, tuple),
            str_from_instance=list,
        )
    kind = _without_none(info.type)
    if kind not in READERS:
        return None
    metavar, read = READERS[kind]
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=lambda texts: read(texts[0]),
        is_instance=lambda value: isinstance(value, kind | None),
        str_from_instance=lambda value: [str(value)],
    )


def _without_none(kind: Any) -> Any:
    """Return T of ``T | None``, everything else as it is."""
    if typing.get_origin(kind) not in (typing.Union, types.UnionType):
        return kind
    others = [part for part in typing.get_args(kind) if part is not types.NoneType]
    return others[0] if len(others) == 1 else kind
