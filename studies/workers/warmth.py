"""What makes a process quick that runs trials: modules it has imported, kernels it has loaded.

One process tells what it has, another gets the same; it runs nothing of a user's for it.
"""

from __future__ import annotations

import importlib
import pickle
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

from ...core.numerics.compiler import Kernel

PACKAGE = __name__.partition(".")[0]

LIBRARIES = frozenset(
    (
        PACKAGE,
        "Box2D",
        "gymnasium",
        "llvmlite",
        "matplotlib",
        "networkx",
        "numba",
        "numpy",
        "pandas",
        "pettingzoo",
        "pydantic",
        "pydantic_core",
        "scipy",
        "torch",
    )
)
"""What may be imported for others: it changes nothing for those who do not use it."""


class Loaded(NamedTuple):
    """A kernel that has been loaded for arguments of some types."""

    module: str
    """Where it is."""
    name: str
    """What it is called there."""
    types: bytes
    """Those of its arguments, pickled."""


class Warmth(NamedTuple):
    """What a process has imported and loaded."""

    modules: tuple[str, ...]
    """Names of modules of `LIBRARIES`, in the order in which they were imported."""
    kernels: tuple[Loaded, ...]
    """Of this package."""


def measure_warmth() -> Warmth:
    """Return what this process has."""
    modules = (name for name in sys.modules if name.partition(".")[0] in LIBRARIES)
    return Warmth(tuple(modules), tuple(_loaded_kernels()))


def _loaded_kernels() -> Iterator[Loaded]:
    for module, content in list(sys.modules.items()):
        if module.partition(".")[0] != PACKAGE:
            continue
        for name, kernel in list(vars(content).items()):
            if isinstance(kernel, Kernel) and kernel.py_func.__module__ == module:
                for types in kernel.signatures:
                    yield Loaded(module, name, pickle.dumps(types))


def warm_up(goal: Warmth, known: Warmth) -> None:
    """Import and load what a process had that is not `known`; what cannot be is left out."""
    for name in goal.modules:
        if name not in sys.modules:
            with suppress(Exception):
                importlib.import_module(name)
    for kernel in {*goal.kernels} - {*known.kernels}:
        with suppress(Exception):
            own = vars(importlib.import_module(kernel.module))[kernel.name]
            own.compiled.compile(pickle.loads(kernel.types))
