"""Isolation of processes from where they start: from the current folder and from closed streams.

Nothing in the current folder is imported, or read as settings of a library.

A study may lie in a folder that somebody else has filled, next to a ``joblib.py`` or a
``matplotlibrc``. Python puts the current folder on `sys.path` for ``-c`` and ``-m``, which is how
most child processes start; matplotlib and numba read settings from it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

SETTINGS_FILES = {"matplotlib": "matplotlibrc", "numba.core.config": ".numba_config.yaml"}
"""Files that libraries read from the current folder, by the module that reads them."""

SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable by which Python leaves the current folder out of `sys.path`."""

FOLDER = os.path.dirname(os.path.abspath(__file__))
"""A folder without settings files."""


class SettingsFilter:
    """Import finder for the modules in `SETTINGS_FILES`; they do not see the current folder."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of such a module; None for every other one."""
        if name not in SETTINGS_FILES:
            return None
        spec = PathFinder.find_spec(name, path)  # type: ignore[arg-type]
        if spec is not None and spec.loader is not None:
            run = partial(_run_elsewhere, spec.loader.exec_module)
            spec.loader.exec_module = run  # type: ignore[method-assign]
        return spec


def _run_elsewhere(run: Callable[[ModuleType], None], module: ModuleType) -> None:
    """Run a module in another folder, but only if the current one has such a file.

    The current folder belongs to the whole process, so other threads see the change.
    """
    is_there = any(map(os.path.lexists, SETTINGS_FILES.values()))
    with contextlib.chdir(FOLDER) if is_there else contextlib.nullcontext():
        run(module)
    if module.__name__ == "numba.core.config":  # numba reads the file again before it compiles
        vars(module)["_config_fname"] = ""


def ignore_settings_files() -> None:
    """Make libraries that are imported from now on ignore settings files in the current folder."""
    if SettingsFilter not in sys.meta_path:
        sys.meta_path.insert(0, SettingsFilter)


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


def restore_child_signal() -> None:
    """Let this process read the exit status of its children, even if its parent ignores SIGCHLD.

    Processes inherit an ignored signal. The system then keeps no exit status for `os.waitpid`.
    """
    if sys.platform != "win32" and signal.getsignal(signal.SIGCHLD) is signal.SIG_IGN:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)


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


def drop_empty_entries() -> None:
    """Remove what empty entries of ``PYTHONPATH`` add to `sys.path`, which is the current folder.

    They are a slip, as in ``PYTHONPATH=$PYTHONPATH:/opt/lib`` where the variable was not set.
    """
    given = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    entries = list(filter(None, given))
    if len(entries) == len(given):
        return
    os.environ["PYTHONPATH"] = os.pathsep.join(entries)
    with contextlib.suppress(OSError, ValueError):  # the folder is gone, or not on the path
        if os.getcwd() not in map(os.path.abspath, entries):
            sys.path.remove(os.getcwd())


def open_standard_streams() -> None:
    """Connect standard streams that are closed, as by ``>&-``, to the null device.

    Otherwise the next file that is opened, such as a database, gets the number of the closed stream
    and receives what libraries print.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    # They stay open to the end of the process.
    sys.stdin = sys.stdin or open(0, encoding="utf-8")  # noqa: SIM115
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8")  # noqa: SIM115
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8")  # noqa: SIM115
