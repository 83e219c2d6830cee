"""The ledger of a study: a directory that loses nothing that was finished.

``results.sqlite`` holds the spec, the conditions, one row per trial and one per episode;
``recordings/IDENTITY.npz`` what a trial recorded, if anything; ``checkpoints/IDENTITY.npz`` what a
trial under way has come to; ``study.toml`` the spec, to read and to run again. The database is
written through (WAL, synchronous=FULL), and a recording is complete before its trial is noted as
done: a crash at any moment costs the running trials only, or what they did since their checkpoints.
Rows and recordings have checksums: what is not as it was written is named, and its trial run again.

The view `results` is made for other tools::

    pandas.read_sql("SELECT * FROM results", sqlite3.connect("DIR/results.sqlite"))
"""

from __future__ import annotations

import json
import os
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...core.interface.measures import Measure
from ...core.shell import command_line
from ..errors import SpecError
from . import database, durable, integrity
from .checksums import find_altered, trial_checksums
from .connection import DamageError, has_log, open_to_read, open_to_write, transaction
from .database import CHECKPOINTS, DATABASE, NoStudyError, Planned, StudyNotes
from .durable import NotRecordedError, Recording

NO_LOG = (
    "is kept with a rollback journal, as on file systems that share no memory (NFS, Lustre, GPFS): "
    "the same results, written more slowly"
)
"""What is said of a database without a write-ahead log."""

NamesAndRows = tuple[list[str], Iterable[tuple[object, ...]]]
"""The names of columns, and rows of values, which may be read one by one."""


class Store:
    """An open study directory. Use `Store.create` to write and `Store.open` to read.

    Attributes
    ----------
    directory
        Where it is.
    notes
        What is damaged, and what was done about it; one line each.
    code_digest
        Digest of the code that computes the trials that are saved; empty if the store only reads.
    """

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        self.directory = directory
        self.notes: list[str] = []
        self._db = connection
        self.code_digest = ""

    @classmethod
    @contextmanager
    def open(cls, directory: Path) -> Iterator[Store]:
        """Open an existing study to read one state of it, whatever is added meanwhile.

        Raises
        ------
        NoStudyError
            If the directory holds no study.
        DamageError
            If its database is damaged as a whole: what it says of the study, or the number of its
            trials. For their rows see `verify`.
        SpecError
            If it cannot be read for another reason, is of another version, or is no study's.
        """
        path = directory / DATABASE
        if integrity.is_orphaned(path):
            raise DamageError(
                path,
                "its log is there without it",
                f"{path}-wal: is the log of a database that is not there any more; "
                f"{command_line('run')} sets it aside",
            )
        if not path.exists():
            raise NoStudyError(f"{directory}: holds no study (no {DATABASE})")
        with open_to_read(path) as connection:
            if (fault := integrity.find_fault(path, connection)) is not None:
                raise DamageError(path, fault)
            yield cls(directory, connection)

    def spec(self) -> Mapping[str, Any]:
        """Return the table of the spec that the study runs."""
        return self._read("spec")

    def sources(self) -> dict[str, str]:
        """Return by name the texts of the users' files that the study names, when it began."""
        return self._read("sources")

    def settings(self) -> dict[str, Any]:
        """Return the settings of each condition by label, as they were when it began."""
        return self._read("conditions")

    def planned(self) -> tuple[Planned, ...]:
        """Return all trials of the study, as they were noted."""
        rows = self._db.execute(
            f"SELECT {', '.join(Planned._fields)} FROM planned ORDER BY position"
        )
        return tuple(
            Planned(identity, condition, seed, dict(_recorded(kept)))
            for identity, condition, seed, kept in rows
        )

    def versions_of_code(self) -> int:
        """Return by how many versions of the installed code finished trials were computed."""
        query = "SELECT count(DISTINCT code) FROM trials WHERE state = 'done'"
        return int(self._db.execute(query).fetchone()[0])

    def code(self) -> dict[str, tuple[str, str]]:
        """Return by module two digests of the code that computed what was added last."""
        return {name: (text, tree) for name, (text, tree) in self._read("code").items()}

    def study_notes(self) -> StudyNotes:
        """Return what the study is, but for its trials and code."""
        return StudyNotes(
            self.spec(), self.settings(), self.columns(), self.sources(), self.measures()
        )

    def measures(self) -> tuple[Measure, ...]:
        """Return what the study measures of its episodes, of any condition."""
        return self._read("measures", database.measures_from)

    def _read(self, key: str, make: Callable[[Any], Any] = dict) -> Any:
        """Return what is noted under `key`, as ``spec`` or ``conditions``."""
        row = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        path = self.directory / DATABASE
        if row is None:
            raise SpecError(f"{path}: is no study: it has no {key}")
        try:
            return make(json.loads(row[0]))
        except (ValueError, TypeError):
            raise SpecError(f"{path}: is damaged: {key} cannot be read") from None

    def verify(self) -> None:
        """Raise `SpecError` if the rows of a trial that was run are not what was written."""
        for where in self._damaged_rows().values():
            raise SpecError(f"{where}; {command_line('run')} runs it again")

    def _damaged_rows(self) -> dict[str, str]:
        """Return by identity whose rows are not what was written, one line each."""
        damaged = find_altered(self._db)
        if not damaged:
            return {}
        known = "SELECT identity, condition, seed FROM "
        trials = self._db.execute(f"{known} trials UNION ALL {known} planned")
        names = {identity: f"{condition}, seed {seed}" for identity, condition, seed in trials}
        path = self.directory / DATABASE
        return {i: f"{path}: {names.get(i, i)}: rows are damaged" for i in damaged}

    def failed(self) -> list[tuple[str, int, str]]:
        """Return condition, seed and traceback of every failed trial."""
        return self._db.execute(
            "SELECT condition, seed, coalesce(error, '') FROM trials "
            "JOIN conditions USING (condition) "
            "WHERE state = 'failed' ORDER BY position, seed"
        ).fetchall()

    def counts(self) -> dict[str, int]:
        """Return how many trials are ``done`` and how many ``failed``."""
        query = "SELECT state, count(*) FROM trials GROUP BY state"
        return {"done": 0, "failed": 0} | dict(self._db.execute(query).fetchall())

    def phases(self) -> list[str]:
        """Return the phases that episodes were run in.

        First training and evaluation, then the stages of curricula and the further evaluations,
        each in their order, then others.
        """
        known = ["training", "evaluation"]
        query = "SELECT phase, min(episode) FROM episodes GROUP BY phase ORDER BY 2, 1"
        recorded = [phase for phase, _ in self._db.execute(query)]
        stages = [phase for phase in recorded if phase.startswith(database.STAGE)]
        evaluations = [
            f"{database.EVALUATION}{name}" for name in self._read("spec").get("evaluations", ())
        ]
        ordered = [*known, *stages, *evaluations]
        return [phase for phase in ordered if phase in recorded] + sorted({*recorded} - {*ordered})

    def columns(self) -> dict[str, dict[str, Any]]:
        """Return what tells each condition from the others, by label; see `Condition`."""
        cursor = self._db.execute("SELECT * FROM conditions ORDER BY position")
        swept = [column[0] for column in cursor.description][2:]
        return {row[1]: dict(zip(swept, row[2:], strict=True)) for row in cursor}

    def episodes(self) -> tuple[list[str], Iterator[tuple[object, ...]]]:
        """Return the column names and the rows of all phases, by condition, seed and episode.

        Rows are read one by one, as long as the study is open: there may be millions.
        """
        cursor = self._db.execute("SELECT * FROM results")
        return [column[0] for column in cursor.description], cursor

    def trials(self) -> tuple[list[str], list[tuple[object, ...]]]:
        """Return the column names and one row per trial, by condition and seed.

        After the swept keys and the seed: its state, its identity, the last line of its traceback
        if it failed, the seconds of each part, and its `numbers`; None where there is no such.
        """
        swept = next(iter(self.columns().values()), {})
        names = [n for (n,) in self._db.execute("SELECT DISTINCT name FROM numbers ORDER BY name")]
        values = {
            (i, n): v for i, n, v in self._db.execute("SELECT identity, name, value FROM numbers")
        }
        parts = ", ".join(f'{part} AS "seconds.{part}"' for part in database.SECONDS)
        cursor = self._db.execute(
            f"SELECT c.condition, {''.join(f'c.{database.quote(key)}, ' for key in swept)}seed, "
            f"state, identity, error, {parts} FROM trials "
            "JOIN conditions c USING (condition) LEFT JOIN seconds USING (identity) "
            "ORDER BY position, seed"
        )
        columns = [column[0] for column in cursor.description]
        identity = columns.index("identity")
        error = columns.index("error")
        rows = []
        for row in cursor:
            last = (row[error] or "").rstrip().rpartition("\n")[2] or None
            measured = (values.get((row[identity], name)) for name in names)
            rows.append((*row[:error], last, *row[error + 1 :], *measured))
        return [*columns, *names], rows

    def mean_seconds(self) -> dict[str, float]:
        """Return by condition how long its finished trials took on average [s]."""
        query = "SELECT condition, avg(total) FROM seconds JOIN trials USING (identity) GROUP BY 1"
        return dict(self._db.execute(query).fetchall())

    def numbers(self) -> list[tuple[str, int, str, float, bool]]:
        """Return condition, seed, name, value and whether it is a function of the trial."""
        return self._db.execute(
            "SELECT condition, seed, n.name, value, repeatable = 1 FROM numbers n "
            "JOIN trials USING (identity) JOIN conditions USING (condition) "
            "ORDER BY position, seed, n.name"
        ).fetchall()

    @classmethod
    @contextmanager
    def create(
        cls, directory: Path, study: StudyNotes, files: Mapping[str, bytes], damage: str | None
    ) -> Iterator[Store]:
        """Open a directory to write, within the context of `lock_directory`.

        A damaged database is set aside under another name, and what can be trusted of it copied.

        Parameters
        ----------
        directory
            The directory; what it holds must be the same study.
        study
            What it is.
        files
            Contents of files that are kept beside the database, by name.
        damage
            What is wrong with its database, see `DamageError`.

        Raises
        ------
        SpecError
            If it cannot be written.
        """
        path = directory / DATABASE
        reason = None if damage is None else f"is damaged: {damage}"
        if damage is None:
            reason = integrity.find_superseded(path, {trial.identity for trial in study.planned})
        aside = None if reason is None else integrity.set_aside(path)
        with open_to_write(path) as connection:
            store = cls(directory, connection)
            with transaction(connection):
                is_new = database.is_empty(connection)
                database.prepare(connection, study)
                if aside is None and is_new and (aside := integrity.last_aside(path)):
                    reason = "was being made anew"
                recovered = 0 if aside is None else integrity.recover(aside, connection)
            if aside is not None:
                store.notes.append(
                    f"{path}: {reason}; kept as {aside.name}, "
                    f"{recovered} trials taken over, the others run again"
                )
            if not has_log(connection):
                store.notes.append(f"{path}: {NO_LOG}")
            for name, content in files.items():
                kept = directory / name
                kept.parent.mkdir(exist_ok=True)
                if not kept.exists() or durable.read_bytes(kept) != content:
                    durable.write(kept, content)
            store.code_digest = study.code_digest
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
        folder = os.fspath(self.directory / "recordings")  # paths of thousands take their time
        query = (
            "SELECT identity, condition, seed, recording_sha256 FROM trials "
            "WHERE recording_sha256 IS NOT NULL"
        )
        for identity, condition, seed, written in self._db.execute(query).fetchall():
            path = f"{folder}/{identity}.npz"
            if identity not in damaged and (digest := durable.sha256(path)) != written:
                what = "is missing" if digest is None else "is damaged"
                damaged[identity] = f"{path}: {what} ({condition}, seed {seed})"
        return damaged

    def save(
        self,
        trial: Planned,
        episodes: Sequence[tuple[object, ...]],
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
            self._insert("seconds", [(identity, *(seconds[part] for part in database.SECONDS))])
            self._insert("numbers", [(identity, n, v, int(exact)) for n, v, exact in numbers])
        with suppress(OSError):
            (self.directory / CHECKPOINTS / f"{identity}.npz").unlink()

    def checkpoints(self) -> dict[str, float]:
        """Return by identity how old the checkpoints of trials are [s]."""
        now = time.time()
        ages = {}
        for file in (self.directory / CHECKPOINTS).glob("*.npz"):
            with suppress(OSError):  # its trial may be kept right now
                ages[file.stem] = max(now - file.stat().st_mtime, 0.0)
        return ages

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
        row = self._db.execute(query, (identity,)).fetchone()
        path = self._recordings(identity)
        if row == (None,):
            raise NotRecordedError(f"{path}: does not exist: the trial recorded nothing")
        return durable.read_recording(path, name, *(row or ()))

    def _recordings(self, identity: str) -> Path:
        return self.directory / "recordings" / f"{identity}.npz"

    @contextmanager
    def _changing(self, *identities: str) -> Iterator[None]:
        """Change trials in one transaction; then note the checksums of some, and how many are."""
        # Of those named alone: all would be counted anew for every trial.
        places = ", ".join("?" * len(identities))
        where = f"WHERE identity IN ({places})" if identities else ""
        count = f"SELECT count(*) FROM checksums {where}"
        with transaction(self._db):
            (before,) = self._db.execute(count, identities).fetchone()
            yield
            for identity in identities:
                self._insert("checksums", list(trial_checksums(self._db, identity)))
            (after,) = self._db.execute(count, identities).fetchone()
            self._db.execute("UPDATE ledger SET trials = trials + ?", (after - before,))

    def _insert(self, table: str, rows: list[tuple[object, ...]]) -> None:
        database.insert(self._db, table, rows)

    def _note(self, trial: Planned, state: str, error: str | None, digest: str | None) -> None:
        # By table: what is left of a trial whose row is gone hangs on nothing.
        for table in ("trials", *database.OF_A_TRIAL):
            self._db.execute(f"DELETE FROM {table} WHERE identity = ?", (trial.identity,))
        row = (trial.identity, trial.condition, trial.seed, state, error, digest, self.code_digest)
        self._insert("trials", [row])


@lru_cache(maxsize=64)
def _recorded(text: str) -> dict[int, str]:
    """Return names of recorded episodes by number, of the text that notes them."""
    return {int(number): name for number, name in json.loads(text).items()}
