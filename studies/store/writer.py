"""Lock of a study's directory, and the trials that its owner is running."""

import json
import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import TextIO

from ...core import locks
from ..errors import SpecError
from . import durable
from .connection import NO_LOCKS

LOCK = ".lock"
"""Name of the file that the writing process locks."""
MARK = "running.json"
"""Name of the file that lists the running trials, removed when a run ends."""
LOCK_WAITS_S = (0.05, 0.1, 0.0)
"""Wait after each attempt to take the lock, which a reader holds for an instant [s]."""


@contextmanager
def lock_directory(directory: Path) -> Iterator[None]:
    """Keep other processes from writing to a directory, which is created if necessary.

    Raises
    ------
    SpecError
        If it cannot be created or written, or another process is writing to it.
    """
    try:
        for folder in (directory, directory / "recordings"):
            folder.mkdir(parents=True, exist_ok=True)
        if (directory / LOCK).exists():
            durable.check_file(directory / LOCK)
        lock = open(directory / LOCK, "w")  # noqa: SIM115 - held until the context ends
    except OSError as error:
        raise SpecError(f"{error.filename}: {error.strerror or error}") from None
    with lock:
        _take(lock, directory)
        durable.remove_incomplete(directory / "recordings")
        yield


def _take(lock: TextIO, directory: Path) -> None:
    """Take the lock of a directory without waiting for another writer."""
    for wait in LOCK_WAITS_S:
        try:
            locks.lock(lock)
            return
        except OSError as error:
            if error.errno in NO_LOCKS:
                raise SpecError(
                    f"{directory}: this file system has no file locks; write on a local disk and "
                    "copy the directory afterwards, or mount it with locks (NFS: without nolock; "
                    "Lustre: flock)"
                ) from None
            time.sleep(wait)
    raise SpecError(f"{directory}: another process is writing there")


class Running(AbstractContextManager["Running"]):
    """Marks a study as running while its context lasts.

    Parameters
    ----------
    directory
        Directory of the study, locked by this process.
    processes
        Number of trials that run at a time.
    """

    def __init__(self, directory: Path, processes: int) -> None:
        self._path = directory / MARK
        self._processes = processes
        self._started: dict[str, float] = {}

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):
            self._path.unlink()

    def start(self, identity: str) -> None:
        """Record that a worker has received a trial."""
        self._started[identity] = time.time()
        self._write()

    def end(self, identity: str) -> None:
        """Forget a trial that has ended."""
        self._started.pop(identity, None)

    def _write(self) -> None:
        temporary = self._path.with_name(f".{MARK}.new")
        # A full disk is no error here, and nothing needs an fsync.
        with suppress(OSError):
            temporary.write_text(
                json.dumps({"processes": self._processes, "started": self._started})
            )
            os.replace(temporary, self._path)


def read_running(directory: Path) -> tuple[int, dict[str, float]] | None:
    """Return the running trials of a study; None if no process runs it.

    Returns
    -------
    tuple
        Number of trials that run at a time, and how long each has been running by identity [s].
    """
    try:
        durable.check_file(directory / LOCK)
        with open(directory / LOCK) as lock:
            locks.lock(lock, shared=True)
        return None
    except BlockingIOError:
        pass  # another process writes there
    except OSError:
        return None
    try:
        mark = json.loads(durable.read_text(directory / MARK))
        now = time.time()
        seconds = {
            identity: max(now - started, 0.0) for identity, started in mark["started"].items()
        }
        return mark["processes"], seconds
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return 1, {}  # is just starting or ending
