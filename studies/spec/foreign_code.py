"""Code outside the toolkit that a study runs: modules that it names, their imports, libraries.

Released packages are compared by their version. Others, which their authors may be changing, are
compared by the text of their files: those on the path of Python and those installed from a folder.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, packages_distributions, version
from importlib.util import find_spec
from pathlib import Path

from ...core.plugins.trust import modules_in

LIBRARIES = ("llvmlite", "numba", "numpy", "scipy")
"""Libraries with versions on which the results of every study may depend."""

OURS = __name__.partition(".")[0]


def library_versions() -> dict[str, str]:
    """Return the installed versions of `LIBRARIES` by name."""
    return {name: _version(name) for name in LIBRARIES}


def foreign_code(
    table: Mapping[str, object], texts: Mapping[str, str]
) -> tuple[dict[str, Path], dict[str, str]]:
    """Return the code outside the toolkit that a study runs.

    Parameters
    ----------
    table
        The spec as a table.
    texts
        Texts of the users' files that it names.

    Returns
    -------
    tuple
        Files of unreleased packages by name, such as ``arms/seven.py``, and versions of libraries.
    """
    files: dict[str, Path] = {}
    versions = library_versions()
    left = [module.partition(".")[0] for module, _ in modules_in(table)]
    for name, text in texts.items():
        left += imported(text) if name.endswith(".py") else ()
    done = {OURS, *versions, *sys.stdlib_module_names}
    while left:
        package = left.pop()
        if package in done:
            continue
        done.add(package)
        released = _released().get(package)
        if released is not None:
            versions[package] = " ".join(map(_version, released))
            continue
        for name, path in python_files(package):
            files[name] = path
            left += imported(path.read_text(encoding="utf-8", errors="replace"))
    return files, versions


def python_files(package: str) -> Iterator[tuple[str, Path]]:
    """Yield the files of an installed package or module at the top, by name; without a file none.

    What cannot be found is reported when it is imported.
    """
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):
        return
    if spec is None:
        return
    if spec.submodule_search_locations is None:
        if spec.origin is not None and spec.origin.endswith(".py"):
            yield Path(spec.origin).name, Path(spec.origin)
        return
    for folder in map(Path, spec.submodule_search_locations):
        for path in sorted(folder.rglob("*.py")):
            yield f"{package}/{path.relative_to(folder).as_posix()}", path


@cache
def _released() -> dict[str, list[str]]:
    """Return the distributions of each installed package or module that came from no folder."""
    installed = packages_distributions()
    return {
        package: sorted(set(names))
        for package, names in installed.items()
        if not any(map(_is_from_folder, names))
    }


def _is_from_folder(name: str) -> bool:
    """Tell whether a distribution was installed from a folder, as PEP 610 records it."""
    return "dir_info" in (distribution(name).read_text("direct_url.json") or "")


def _version(name: str) -> str:
    """Return the version of a library; without metadata it is unknown."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"


def imported(text: str) -> set[str]:
    """Return the top-level names of all modules that Python text imports; none if it is no Python.

    Examples
    --------
    >>> sorted(imported("import numpy.linalg; from tank import Tank"))
    ['numpy', 'tank']
    """
    try:
        nodes = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError):
        return set()
    names = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    names |= {n.module or "" for n in nodes if isinstance(n, ast.ImportFrom) and not n.level}
    return {name.partition(".")[0] for name in names}
