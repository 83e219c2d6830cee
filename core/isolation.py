"""Processes and code of users that are independent of the current folder.

A study may lie in a folder that somebody else has filled, for example with a ``joblib.py``. Python
puts the current folder on `sys.path` for ``-c`` and ``-m``, which is how most child processes
start.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator

SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable by which Python leaves the current folder out of `sys.path`."""


def python_command(program: str) -> list[str]:
    """Return the command that runs a program in a new Python process with the same `sys.path`."""
    path = [entry for entry in sys.path if isinstance(entry, str)]
    return [sys.executable, "-P", "-c", f"import sys; sys.path[:] = {path!r}; {program}"]


@contextlib.contextmanager
def safe_path() -> Iterator[None]:
    """Keep the current folder off the `sys.path` of Python processes that start in this context.

    This is for processes that libraries start: workers, and those that free shared memory.
    """
    former = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if former is None:
            os.environ.pop(SAFE_PATH, None)
        else:
            os.environ[SAFE_PATH] = former


@contextlib.contextmanager
def same_folder() -> Iterator[None]:
    """Return to the current folder when code of users ends, which may have changed it."""
    try:
        folder = os.getcwd()
    except OSError:  # it has been deleted
        folder = None
    try:
        yield
    finally:
        if folder is not None:
            with contextlib.suppress(OSError):
                os.chdir(folder)
