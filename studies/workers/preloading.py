"""Preloading: modules and kernels that a new process loads before it runs trials.

One process reports its modules and kernels, and another loads the same. No user code runs for this.
"""

from __future__ import annotations

import importlib
import pickle
import sys
from collections.abc import Iterator
from contextlib import suppress

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
"""Modules that may be preloaded, because their import has no side effects."""


LoadedKernel = tuple[str, str, bytes]
"""Module of a kernel of this package, its name there, and pickled types of its arguments."""
LoadedCode = tuple[tuple[str, ...], tuple[LoadedKernel, ...]]
"""Names of modules of `LIBRARIES`, in the order of their import, and kernels."""


def loaded_code() -> LoadedCode:
    """Return the modules and kernels that this process has loaded."""
    modules = (name for name in sys.modules if name.partition(".")[0] in LIBRARIES)
    return tuple(modules), tuple(_loaded_kernels())


def _loaded_kernels() -> Iterator[LoadedKernel]:
    for module, content in list(sys.modules.items()):
        if module.partition(".")[0] != PACKAGE:
            continue
        for name, kernel in list(vars(content).items()):
            if isinstance(kernel, Kernel) and kernel.py_func.__module__ == module:
                for types in kernel.signatures:
                    yield module, name, pickle.dumps(types)


def preload(goal: LoadedCode, known: LoadedCode) -> None:
    """Load the modules and kernels of `goal` that are not `known`. Errors are ignored."""
    for name in goal[0]:
        if name not in sys.modules:
            with suppress(Exception):
                importlib.import_module(name)
    for module, name, types in {*goal[1]} - {*known[1]}:
        with suppress(Exception):
            own = vars(importlib.import_module(module))[name]
            own.compiled.compile(pickle.loads(types))
