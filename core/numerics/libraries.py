"""Libraries that take their time: each is imported when something of it is first asked for."""

import importlib
from typing import TYPE_CHECKING, Any


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
        return getattr(importlib.import_module(self._name), attribute)


if TYPE_CHECKING:
    import networkx as nx
    import pandas as pd
    from scipy import optimize, special, stats
else:
    nx = Deferred("networkx")
    pd = Deferred("pandas")
    optimize, special, stats = map(Deferred, ("scipy.optimize", "scipy.special", "scipy.stats"))

__all__ = ["nx", "optimize", "pd", "special", "stats"]
