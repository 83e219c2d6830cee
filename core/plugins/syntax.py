"""Imports of Python text."""

import ast


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
