"""Modules that are imported when something of them is first used, since they take their time."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Deferred:
    """A module that is imported when something of it is first asked for.

    Parameters
    ----------
    name
        Its full name.

    Examples
    --------
    >>> math = Deferred("math")
    >>> math.floor(2.5)
    2
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        """Return what the module has by this name."""
        if attribute.startswith("__"):  # asked by who inspects the object, not by who uses it
            raise AttributeError(attribute)
        return getattr(import_module(self._name), attribute)
