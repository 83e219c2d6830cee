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

import fcntl
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ...core.interface.measures import Measure
from ...core.plugins.sources import FOLDER, kept_name
from ..spec.errors import SpecError
from ..spec.toml import dumps
from ..trials import code
from ..trials.episodes import Recording
from . import database, durable, integrity
from .database import DATABASE, SPEC_FILE
from .reading import Identified, Planned, Reading, T
from .running import LOCK
from .schema import SECONDS, prepare, trial_checksums

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

__all__ = ["DATABASE", "SPEC_FILE", "Identified", "Planned", "Store"]


class Store(Reading):
    """An open study directory. Use `Store.create` to write and `Store.open` to read.

    Attributes
    ----------
    directory
        Where it is.
    notes
        What was found damaged, and what was done about it; one line each.
    """

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        super().__init__(directory, connection)
        self.notes: list[str] = []
        self._code = ""  # what computes what is saved

    @classmethod
    @contextmanager
    def create(
        cls,
        directory: Path,
        spec: Spec,
        measures: Sequence[Measure],
        *,
        accept_code: bool = False,
    ) -> Iterator[Store]:
        """Open a directory to run `spec` in; make it if it does not exist.

        A damaged database is set aside under another name, and what can be trusted of it copied.

        Parameters
        ----------
        directory
            The directory.
        spec
            The study.
        measures
            What it measures of its episodes, see `nested_agents.studies.trials.arrangement.check`.
        accept_code
            Whether to go on although the installed code has changed since.

        Raises
        ------
        SpecError
            If it cannot be written, holds a study that differs by more than additional seeds, or
            another process is writing to it. Nothing has been changed then.
        """
        from .refusal import Given, examine

        given = Given(spec, measures, accept_code)
        examine(directory, given)  # what is refused leaves nothing behind
        path = directory / DATABASE
        try:
            for folder in (directory, directory / "recordings"):
                folder.mkdir(parents=True, exist_ok=True)
            lock = open(directory / LOCK, "w")  # noqa: SIM115 - held until the store is closed
        except OSError as error:
            raise SpecError(f"{error.filename}: {error.strerror or error}") from None
        with lock:
            _take(lock, directory)
            damage = examine(directory, given)  # again: nobody else writes from here on
            aside = integrity.set_aside(path) if damage is not None else None
            goes_on = integrity.holds_tables(path)
            with database.writing(path) as connection:
                store = cls(directory, connection)
                computed_by = code.present(store.known_code() if goes_on else None)
                with database.transaction(connection):
                    prepare(connection, spec, measures, computed_by)
                    recovered = 0 if aside is None else integrity.recover(aside, connection)
                if aside is not None:
                    store.notes.append(
                        f"{path}: is damaged: {damage}; kept as {aside.name}, "
                        f"{recovered} trials taken over, the others run again"
                    )
                store._keep_spec(spec)
                store._code = code.digest(computed_by)
                yield store

    def _keep_spec(self, spec: Spec) -> None:
        """Keep copies of the spec and of users' files, to read and to run them again."""
        from .refusal import is_copy

        path = self.directory / SPEC_FILE
        if not is_copy(path, spec):
            durable.write(path, dumps(spec.table()).encode())
        folder = self.directory / FOLDER
        for name, text in spec.sources.texts.items():
            folder.mkdir(exist_ok=True)
            kept = folder / kept_name(name)
            if not kept.exists() or kept.read_bytes() != text.encode():
                durable.write(kept, text.encode())

    def states(self) -> dict[str, str]:
        """Return by identity whether trials are ``done`` or ``failed``; those that are damaged not.

        What is damaged is added to the `notes`.
        """
        states = dict(self._db.execute("SELECT identity, state FROM trials").fetchall())
        for identity, line in self.damage().items():
            states.pop(identity, None)
            self.notes.append(f"{line}; must run again")
        return states

    def pending(self, trials: Iterable[T]) -> list[T]:
        """Return the trials that have neither failed nor finished with undamaged results.

        What is damaged is added to the `notes`.
        """
        states = self.states()
        return [trial for trial in trials if trial.identity not in states]

    def damage(self) -> dict[str, str]:
        """Return by identity which trials are not as they were written, one line each."""
        found = self._damaged_rows()
        query = (
            "SELECT identity, condition, seed, recording_sha256 FROM trials WHERE state = 'done'"
        )
        for identity, condition, seed, noted in self._db.execute(query).fetchall():
            path = self._recordings(identity)
            if identity not in found and (digest := durable.sha256(path)) != noted:
                what = "is missing" if digest is None else "is damaged"
                found[identity] = f"{path}: {what} ({condition}, seed {seed})"
        return found

    def save(self, trial: Trial, result: TrialResult, total: float) -> None:
        """Keep the result of a trial that took `total` seconds; durable on return.

        Raises
        ------
        ValueError
            If it has a measure that the study has not.
        """
        identity, names = trial.identity, [m.name for m in self.measures()]
        if unknown := {m.name for m in result.measures} - set(names):
            raise ValueError(f"measures {sorted(unknown)}: the study has {names}")
        digest = durable.write_recordings(self._recordings(identity), result.recordings)
        seconds = {**result.seconds, "total": total}
        numbers = [(n, v, 1) for n, v in result.numbers.items()]
        numbers += [(n, v, 0) for n, v in result.usage.items()]
        with self._changing(identity):
            self._note(trial, "done", None, digest)
            self._insert("episodes", [(identity, *row.flat(names)) for row in result.rows])
            self._insert("seconds", [(identity, *(seconds[part] for part in SECONDS))])
            self._insert("numbers", [(identity, *number) for number in numbers])

    def fail(self, trial: Trial, error: str) -> None:
        """Keep the traceback of a trial that failed."""
        with self._changing(trial.identity):
            self._note(trial, "failed", error, None)

    def forget_failed(self) -> int:
        """Make the failed trials pending again; return how many."""
        with self._changing():
            return self._db.execute("DELETE FROM trials WHERE state = 'failed'").rowcount

    def recording(self, trial: Identified, name: str) -> Recording:
        """Return a recorded episode of a trial, by its name in `Trial.recorded`."""
        query = "SELECT recording_sha256 FROM trials WHERE identity = ?"
        noted = self._db.execute(query, (trial.identity,)).fetchone()
        return durable.read_recording(self._recordings(trial.identity), name, *(noted or ()))

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

    def _note(self, trial: Trial, state: str, error: str | None, digest: str | None) -> None:
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
