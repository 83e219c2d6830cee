"""Who writes to the directory of a study: one process at a time, and which trials it runs."""

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
from .connection import NO_LOCKS, NoLocksError

LOCK = ".lock"
"""Name of the file whose lock is held by whoever writes."""
MARK = "running.json"
"""Name of the file that tells what is running."""


@contextmanager
def lock_directory(directory: Path) -> Iterator[None]:
    """Keep others from writing to a directory, which is made if it does not exist.

    Raises
    ------
    SpecError
        If it cannot be made or written, or another process is writing to it.
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
        yield


def _take(lock: TextIO, directory: Path) -> None:
    """Take the lock of a directory; it is not waited for, but for a look at it."""
    for wait in (0.05, 0.1, 0.0):
        try:
            locks.lock(lock)
            return
        except OSError as error:
            if error.errno in NO_LOCKS:
                raise NoLocksError(directory) from None
            time.sleep(wait)
    raise SpecError(f"{directory}: another process is writing there")


class Running(AbstractContextManager["Running"]):
    """Marks a study as running for as long as its context lasts.

    Parameters
    ----------
    directory
        Of the study, whose lock this process holds.
    processes
        How many trials run at a time.
    """

    def __init__(self, directory: Path, processes: int) -> None:
        self._path = directory / MARK
        self._processes = processes
        self._begun: dict[str, float] = {}

    def __exit__(self, *_: object) -> None:
        self._begun.clear()
        self._write()

    def begin(self, identity: str) -> None:
        """Note that a trial has been handed to a worker."""
        self._begun[identity] = time.time()
        self._write()

    def end(self, identity: str) -> None:
        """Forget a trial that has come back; who looks counts what is done as done."""
        self._begun.pop(identity, None)

    def _write(self) -> None:
        temporary = self._path.with_name(f".{MARK}.new")
        # Not worth an fsync, nor an error if the disk is full.
        with suppress(OSError):
            temporary.write_text(json.dumps({"processes": self._processes, "begun": self._begun}))
            os.replace(temporary, self._path)


def look(directory: Path) -> tuple[int, dict[str, float]] | None:
    """Return what is running in the directory of a study; None if nothing is.

    Returns
    -------
    tuple
        How many trials run at a time, and by identity how long each has been running so far [s].
    """
    try:
        durable.check_file(directory / LOCK)
        with open(directory / LOCK) as lock:
            locks.lock(lock, shared=True)
        return None
    except BlockingIOError:
        pass  # somebody writes there
    except OSError:
        return None
    try:
        mark = json.loads(durable.read_text(directory / MARK))
        now = time.time()
        seconds = {identity: max(now - begun, 0.0) for identity, begun in mark["begun"].items()}
        return mark["processes"], seconds
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return 1, {}  # begins or ends just now
