"""A light mark of what is running: for the eye only, nothing is decided by it.

``running.json`` in the directory of a study names the trials that workers have been handed. Whether
anything runs at all is shown by the lock that the running process holds on ``.lock``, and which the
system takes from it however it ends: a mark that outlived its process is passed over.
"""

import contextlib
import fcntl
import json
import os
import time
from pathlib import Path

LOCK = ".lock"
MARK = "running.json"


class Running(contextlib.AbstractContextManager["Running"]):
    """Keeps the mark while its context lasts.

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
        """Note that a trial has come back."""
        self._begun.pop(identity, None)
        self._write()

    def _write(self) -> None:
        temporary = self._path.with_name(f".{MARK}.new")
        # Not worth an fsync, nor an error if the disk is full.
        with contextlib.suppress(OSError):
            temporary.write_text(json.dumps({"processes": self._processes, "begun": self._begun}))
            os.replace(temporary, self._path)


def look(directory: Path) -> tuple[int, dict[str, float]] | None:
    """Return what is running in the directory of a study; None if nothing is.

    Returns
    -------
    tuple
        How many trials run at a time, and by identity how long each has been running so far [s].
    """
    if not _locked(directory / LOCK):
        return None
    try:
        mark, now = json.loads((directory / MARK).read_text()), time.time()
        seconds = {identity: max(now - begun, 0.0) for identity, begun in mark["begun"].items()}
        return mark["processes"], seconds
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return 1, {}  # begins or ends just now


def last(directory: Path) -> int | None:
    """Return how many trials the last run in a directory ran at a time; None if that is unknown."""
    try:
        processes = json.loads((directory / MARK).read_text())["processes"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return processes if isinstance(processes, int) and processes > 0 else None


def _locked(path: Path) -> bool:
    try:
        with open(path) as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
