"""Large libraries, imported on first use."""

import importlib
from typing import TYPE_CHECKING, Any


class Deferred:
    """A module that is imported on first use.

    Parameters
    ----------
    name
        Full name of the module.

    Examples
    --------
    >>> math = Deferred("math")
    >>> math.floor(2.5)
    2
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        """Return an attribute of the module."""
        if attribute.startswith("__"):  # inspection must not import the module
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
