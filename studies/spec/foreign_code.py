"""Code outside the toolkit that a study runs: modules that it names, their imports, libraries.

Small packages are compared by the text of their files, large ones by their version.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

from ...core.plugins.syntax import imported
from ...core.plugins.trust import modules_in

LIBRARIES = ("llvmlite", "numba", "numpy", "scipy")
"""Libraries with versions on which the results of every study may depend."""

MAX_FILES = 300
"""A package with more files counts as a library, which its version identifies."""

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
        Files by name, such as ``arms/seven.py``, and versions of libraries by name.
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
        paths = list(islice(python_files(package), MAX_FILES + 1))
        if len(paths) > MAX_FILES:
            versions[package] = _version(package)
            continue
        for name, path in paths:
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


def _version(name: str) -> str:
    """Return the version of a library; without metadata it is unknown."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
