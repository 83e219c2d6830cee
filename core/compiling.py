"""Compilation of kernels, cached on disk until anything changes that they are made of.

numba takes a cached kernel for good as long as the file of the kernel is what it was. A kernel is
also made of the kernels that it calls and of the constants that it reads, wherever they come from:
here the files that its own file imports, and those that these import, count as well.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])

IMPORT = re.compile(r"^\s*from (\.+)([\w.]*) import ", re.MULTILINE)
"""An import inside the package; the house rules know no other."""


def njit(**options: Any) -> Callable[[F], F]:
    """Return `numba.njit`, with a cache that knows all that a kernel is made of."""

    def decorate(function: F) -> F:
        compiled = numba.njit(**options)(function)
        file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
        if file is not None:  # interpreted kernels, NUMBA_DISABLE_JIT=1, have none
            file._source_stamp = (file._source_stamp, stamp(Path(function.__code__.co_filename)))
        return compiled

    return decorate


def stamp(path: Path) -> str:
    """Return a digest of a file and of all files that it imports, directly or not."""
    found, left = {path}, [path]
    while left:
        new = set(_imported(left.pop())) - found
        found |= new
        left += new
    texts = hashlib.sha256()
    for each in sorted(found):
        texts.update(_text(each).encode() + b"\0")
    return texts.hexdigest()


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    return tuple(_targets(path))


def _targets(path: Path) -> Iterator[Path]:
    """Yield the files that a file imports; of a package from which modules may come, all."""
    for dots, name in IMPORT.findall(_text(path)):
        place = path.parents[len(dots) - 1].joinpath(*filter(None, name.split(".")))
        if place.is_dir():
            yield from sorted(place.glob("*.py"))
        elif (module := place.with_suffix(".py")).exists():
            yield module


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
