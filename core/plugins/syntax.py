"""Syntax trees and imports of Python text, the same under every version of Python."""

import ast
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Look for no garbage meanwhile: that takes longer than to read a file, which leaves none."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@uncollected()
def tree_text(text: str, name: str) -> str:
    """Return the syntax tree of Python text as Python 3.11 writes it, whichever version runs.

    Later versions know parameters of types, which are left out where there are none. Python 3.12
    ends some formats with an empty text, and Python 3.13 leaves out what is empty unless asked.

    Raises
    ------
    SyntaxError, ValueError, RecursionError
        If it is no Python; `name` is that of its file.
    """
    tree = ast.parse(text, name)
    if sys.version_info >= (3, 12):
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                node.values = [value for value in node.values if not _is_empty(value)]
            elif isinstance(node, WITH_TYPES) and not node.type_params:
                del node.type_params
    if sys.version_info >= (3, 13):
        return ast.dump(tree, show_empty=True)
    return ast.dump(tree)


WITH_TYPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
"""Syntax nodes that may have type parameters."""


def _is_empty(value: ast.expr) -> bool:
    return isinstance(value, ast.Constant) and value.value == ""


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
