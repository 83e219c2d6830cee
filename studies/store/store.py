"""The ledger of a study: a directory that loses nothing that was finished.

``results.sqlite`` holds the spec, the conditions, one row per trial and one per episode;
``recordings/IDENTITY.npz`` the recorded episodes of a trial; ``study.toml`` the spec, to read and
to run again. The database is written through (WAL, synchronous=FULL), and a recording is complete
before its trial is noted as done: a crash at any moment costs the running trials only. Rows and
recordings have checksums: what is not as it was written is named, and its trial run again.

The view `results` is made for other tools::

    pandas.read_sql("SELECT * FROM results", sqlite3.connect("DIR/results.sqlite"))
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from ..errors import SpecError
from . import database, durable, integrity
from .database import DATABASE, SPEC_FILE
from .durable import Recording
from .reading import Reading
from .schema import SECONDS, Noted, Planned, prepare, trial_checksums

__all__ = ["DATABASE", "SPEC_FILE", "Noted", "Planned", "Store", "locked"]


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Keep others from writing to a directory, which is made if it does not exist.

    Raises
    ------
    SpecError
        If it cannot be made or written, or another process is writing to it.
    """
    try:
        for folder in (directory, directory / "recordings"):
            folder.mkdir(parents=True, exist_ok=True)
        lock = open(directory / LOCK, "w")  # noqa: SIM115 - held until the context ends
    except OSError as error:
        raise SpecError(f"{error.filename}: {error.strerror or error}") from None
    with lock:
        _take(lock, directory)
        yield


class Store(Reading):
    """An open study directory. Use `Store.create` to write and `Store.open` to read.

    Attributes
    ----------
    directory
        Where it is.
    notes
        What is damaged, and what was done about it; one line each.
    """

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        super().__init__(directory, connection)
        self.notes: list[str] = []
        self._code = ""  # what computes what is saved

    @classmethod
    @contextmanager
    def create(
        cls, directory: Path, noted: Noted, files: Mapping[str, bytes], damage: str | None
    ) -> Iterator[Store]:
        """Open a directory to write, within the context of `locked`.

        A damaged database is set aside under another name, and what can be trusted of it copied.

        Parameters
        ----------
        directory
            The directory; what it holds must be the same study.
        noted
            What the study is.
        files
            Contents of files that are kept beside the database, by name.
        damage
            What is wrong with its database, see `integrity.damage`.

        Raises
        ------
        SpecError
            If it cannot be written.
        """
        path = directory / DATABASE
        aside = integrity.set_aside(path) if damage is not None else None
        with database.writing(path) as connection:
            store = cls(directory, connection)
            with database.transaction(connection):
                prepare(connection, noted)
                recovered = 0 if aside is None else integrity.recover(aside, connection)
            if aside is not None:
                store.notes.append(
                    f"{path}: is damaged: {damage}; kept as {aside.name}, "
                    f"{recovered} trials taken over, the others run again"
                )
            for name, content in files.items():
                kept = directory / name
                kept.parent.mkdir(exist_ok=True)
                if not kept.exists() or kept.read_bytes() != content:
                    durable.write(kept, content)
            store._code = noted.code_digest
            yield store

    def states(self) -> dict[str, str]:
        """Return by identity whether trials are ``done`` or ``failed``; those that are damaged not.

        What is damaged is added to the `notes`.
        """
        states = dict(self._db.execute("SELECT identity, state FROM trials").fetchall())
        for identity, line in self.damage().items():
            states.pop(identity, None)
            self.notes.append(f"{line}; must run again")
        return states

    def damage(self) -> dict[str, str]:
        """Return by identity which trials are not as they were written, one line each."""
        damaged = self._damaged_rows()
        query = (
            "SELECT identity, condition, seed, recording_sha256 FROM trials WHERE state = 'done'"
        )
        for identity, condition, seed, noted in self._db.execute(query).fetchall():
            path = self._recordings(identity)
            if identity not in damaged and (digest := durable.sha256(path)) != noted:
                what = "is missing" if digest is None else "is damaged"
                damaged[identity] = f"{path}: {what} ({condition}, seed {seed})"
        return damaged

    def save(
        self,
        trial: Planned,
        episodes: Sequence[tuple[Any, ...]],
        seconds: Mapping[str, float],
        numbers: Sequence[tuple[str, float, bool]],
        recordings: Mapping[str, Recording],
    ) -> None:
        """Keep the result of a trial; durable on return.

        Parameters
        ----------
        trial
            The trial.
        episodes
            A row for each, in the order of `columns`.
        seconds
            What its parts took, see `SECONDS`.
        numbers
            Name, value, and whether it is a function of the trial.
        recordings
            Recorded episodes by name.
        """
        identity = trial.identity
        digest = durable.write_recordings(self._recordings(identity), recordings)
        with self._changing(identity):
            self._note(trial, "done", None, digest)
            self._insert("episodes", [(identity, *row) for row in episodes])
            self._insert("seconds", [(identity, *(seconds[part] for part in SECONDS))])
            self._insert("numbers", [(identity, n, v, int(exact)) for n, v, exact in numbers])

    def fail(self, trial: Planned, error: str) -> None:
        """Keep the traceback of a trial that failed."""
        with self._changing(trial.identity):
            self._note(trial, "failed", error, None)

    def forget_failed(self) -> int:
        """Make the failed trials pending again; return how many."""
        with self._changing():
            return self._db.execute("DELETE FROM trials WHERE state = 'failed'").rowcount

    def recording(self, identity: str, name: str) -> Recording:
        """Return a recorded episode of a trial by its name in `Planned.recorded`, or its `TEAM`."""
        query = "SELECT recording_sha256 FROM trials WHERE identity = ?"
        noted = self._db.execute(query, (identity,)).fetchone()
        return durable.read_recording(self._recordings(identity), name, *(noted or ()))

    def _recordings(self, identity: str) -> Path:
        return self.directory / "recordings" / f"{identity}.npz"

    @contextmanager
    def _changing(self, *identities: str) -> Iterator[None]:
        """Change trials in one transaction; then note the checksums of some, and how many are."""
        count = "SELECT count(*) FROM checksums"
        with database.transaction(self._db):
            (before,) = self._db.execute(count).fetchone()
            yield
            for identity in identities:
                self._insert("checksums", list(trial_checksums(self._db, identity)))
            (after,) = self._db.execute(count).fetchone()
            self._db.execute("UPDATE ledger SET trials = trials + ?", (after - before,))

    def _insert(self, table: str, rows: list[tuple[Any, ...]]) -> None:
        database.insert(self._db, table, rows)

    def _note(self, trial: Planned, state: str, error: str | None, digest: str | None) -> None:
        self._db.execute("DELETE FROM trials WHERE identity = ?", (trial.identity,))
        row = (trial.identity, trial.condition, trial.seed, state, error, digest, self._code)
        self._insert("trials", [row])


def _take(lock: TextIO, directory: Path) -> None:
    """Take the lock of a directory; it is not waited for, but for a look at it."""
    for wait in (0.05, 0.1, 0.0):
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError:
            time.sleep(wait)
    raise SpecError(f"{directory}: another process is writing there")


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


def _locked(path: Path) -> bool:
    try:
        with open(path) as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
