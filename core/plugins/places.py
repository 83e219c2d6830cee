"""Things named by where they are, imported when they are asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def located(place: str) -> Any:
    """Return what ``"package.module:Name"`` names; without a name, the module.

    >>> located("math:pi")
    3.141592653589793
    """
    module, _, attribute = place.partition(":")
    found: Any = import_module(module)
    for part in filter(None, attribute.split(".")):
        found = getattr(found, part)
    return found
