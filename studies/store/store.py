"""Trial store of a study: a directory in which no finished trial is lost.

``results.sqlite`` holds the spec, the conditions, one row per trial and one per episode;
``recordings/IDENTITY.npz`` the recorded episodes of a trial, if any; ``checkpoints/IDENTITY.npz``
the state of a running trial; ``study.toml`` the spec, to read and to run again. Every commit is
synchronous, and the recordings of a trial are complete before its rows are committed, so a crash
costs at most the running trials since their checkpoints. Rows and recordings have checksums: a
trial that does not match them is reported, and `run` runs it again.

Other tools read the view `results`::

    pandas.read_sql("SELECT * FROM results", sqlite3.connect("DIR/results.sqlite"))
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...core.interface.measures import Measure
from ...core.shell import command_line
from ..errors import SpecError, exception_line
from . import database, durable, integrity
from .checksums import find_altered, trial_checksums
from .connection import open_to_read, open_to_write, transaction
from .database import CHECKPOINTS, DATABASE, RESULTS_VERSION, NoStudyError, Planned, StudyNotes
from .durable import NotRecordedError, Recording


class Store:
    """An open study directory. Use `Store.create` to write and `Store.open` to read.

    Attributes
    ----------
    directory
        Where it is.
    version
        Results version of its trials.
    notes
        Remarks on damaged trials, one line each.
    code_digest
        Digest of the code that computes the saved trials; empty if the store is only read.
    """

    def __init__(
        self, directory: Path, connection: sqlite3.Connection, version: int = RESULTS_VERSION
    ) -> None:
        self.directory = directory
        self.version = version
        self.notes: list[str] = []
        self._db = connection
        self.code_digest = ""

    @classmethod
    @contextmanager
    def open(cls, directory: Path) -> Iterator[Store]:
        """Open an existing study to read one state of it, while others may write.

        Raises
        ------
        NoStudyError
            If the directory holds no study.
        SpecError
            If it is damaged as a whole, see `verify` for the rows of its trials; it cannot be read
            for another reason, has been written by a newer version, or does not belong to a study.
        """
        path = directory / DATABASE
        if not path.exists():
            above = directory.parent
            hint = f"; {above} holds one" if (above / DATABASE).exists() else ""
            raise NoStudyError(f"{directory}: holds no study (no {DATABASE}){hint}")
        with open_to_read(path) as connection:
            yield cls(directory, connection, integrity.check_study(path, connection))

    @property
    def is_older(self) -> bool:
        """Whether an older version has computed the results; they are read, not continued."""
        return self.version < RESULTS_VERSION

    def spec(self) -> Mapping[str, Any]:
        """Return the table of the spec that the study runs."""
        return self._read("spec")

    def sources(self) -> dict[str, str]:
        """Return the texts of the users' files that the study names, by name."""
        return self._read("sources")

    def settings(self) -> dict[str, Any]:
        """Return the settings of each condition by label."""
        return self._read("conditions")

    def planned(self) -> tuple[Planned, ...]:
        """Return all trials of the study."""
        rows = self._db.execute(
            f"SELECT {', '.join(Planned._fields)} FROM planned ORDER BY position"
        )
        return tuple(
            Planned(identity, condition, seed, dict(_recorded(kept)))
            for identity, condition, seed, kept in rows
        )

    def code(self) -> dict[str, str]:
        """Return digests of the code that the last run used, by module."""
        return dict(self._read("code"))

    def study_notes(self) -> StudyNotes:
        """Return the description of the study without its trials and code."""
        return StudyNotes(
            self.spec(), self.settings(), self.columns(), self.sources(), self.measures()
        )

    def measures(self) -> tuple[Measure, ...]:
        """Return the measures of episodes in any condition."""
        return self._read("measures", database.measures_from)

    def _read(self, key: str, make: Callable[[Any], Any] = dict) -> Any:
        """Return an entry of the table ``meta``, such as ``spec`` or ``conditions``."""
        row = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        path = self.directory / DATABASE
        if row is None:
            raise SpecError(f"{path}: is no study: it has no {key}")
        try:
            return make(json.loads(row[0]))
        except (ValueError, TypeError):
            raise SpecError(f"{path}: is damaged: {key} cannot be read") from None

    def verify(self) -> None:
        """Raise `SpecError` if the rows of a trial do not match their checksum."""
        for where in self._damaged_rows().values():
            raise SpecError(f"{where}; {command_line('run')} runs it again")

    def _damaged_rows(self) -> dict[str, str]:
        """Return one line for each trial with rows that differ from their checksum, by identity."""
        damaged = [] if self.is_older else find_altered(self._db)
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
        """Return the phases of the episodes.

        Training and evaluation come first, then the stages of curricula in their order, then the
        further evaluations in their order, then all others.
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
        """Return the swept keys of each condition, by label."""
        cursor = self._db.execute("SELECT * FROM conditions ORDER BY position")
        swept = [column[0] for column in cursor.description][2:]
        return {row[1]: dict(zip(swept, row[2:], strict=True)) for row in cursor}

    def episodes(self) -> tuple[list[str], Iterator[tuple[object, ...]]]:
        """Return the column names and the rows of all phases, by condition, seed and episode.

        The iterator reads rows one by one while the study is open, because there may be millions.
        """
        cursor = self._db.execute("SELECT * FROM results")
        return [column[0] for column in cursor.description], cursor

    def trials(self) -> tuple[list[str], list[tuple[object, ...]]]:
        """Return the column names and one row per trial, by condition and seed.

        The swept keys and the seed are followed by the state, the identity, the last line of the
        traceback, the seconds of each part and the `numbers`. A missing value is None, as is a
        time of zero: the trial did not measure this part.
        """
        swept = next(iter(self.columns().values()), {})
        names = [n for (n,) in self._db.execute("SELECT DISTINCT name FROM numbers ORDER BY name")]
        values = {
            (i, n): v for i, n, v in self._db.execute("SELECT identity, name, value FROM numbers")
        }
        parts = ", ".join(f'nullif({part}, 0.0) AS "seconds.{part}"' for part in database.SECONDS)
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
            reason = exception_line(row[error] or "") or None
            measured = (values.get((row[identity], name)) for name in names)
            rows.append((*row[:error], reason, *row[error + 1 :], *measured))
        return [*columns, *names], rows

    def mean_seconds(self) -> dict[str, float]:
        """Return the mean duration of finished trials by condition [s]."""
        query = "SELECT condition, avg(total) FROM seconds JOIN trials USING (identity) GROUP BY 1"
        return dict(self._db.execute(query).fetchall())

    def numbers(self) -> list[tuple[str, int, str, float, bool]]:
        """Return condition, seed, name and value of each number, and whether it is repeatable."""
        return self._db.execute(
            "SELECT condition, seed, n.name, value, repeatable = 1 FROM numbers n "
            "JOIN trials USING (identity) JOIN conditions USING (condition) "
            "ORDER BY position, seed, n.name"
        ).fetchall()

    @classmethod
    @contextmanager
    def create(
        cls, directory: Path, study: StudyNotes, files: Mapping[str, bytes]
    ) -> Iterator[Store]:
        """Open a directory to write, within the context of `lock_directory`.

        Parameters
        ----------
        directory
            A new directory, or one that holds the same study.
        study
            Description of the study.
        files
            Contents of files in the folder of the database, by name.

        Raises
        ------
        SpecError
            If it cannot be written.
        """
        with open_to_write(directory / DATABASE) as connection:
            store = cls(directory, connection)
            with transaction(connection):
                database.prepare(connection, study)
            for name, content in files.items():
                kept = directory / name
                kept.parent.mkdir(exist_ok=True)
                if not kept.exists() or durable.read_bytes(kept) != content:
                    durable.write(kept, content)
            store.code_digest = study.code_digest
            yield store

    def states(self) -> dict[str, str]:
        """Return ``done`` or ``failed`` for each undamaged trial, by identity.

        A remark on each damaged trial is added to the `notes`.
        """
        states = dict(self._db.execute("SELECT identity, state FROM trials").fetchall())
        for identity, line in self.damage().items():
            states.pop(identity, None)
            self.notes.append(f"{line}; must run again")
        return states

    def damage(self) -> dict[str, str]:
        """Return one line for each trial that does not match its checksums, by identity."""
        damaged = self._damaged_rows()
        folder = os.fspath(self.directory / "recordings")  # faster than thousands of paths
        query = (
            "SELECT identity, condition, seed, recording_sha256 FROM trials "
            "WHERE recording_sha256 IS NOT NULL"
        )
        for identity, condition, seed, written in self._db.execute(query).fetchall():
            if identity in damaged:
                continue
            try:
                durable.read_checked(f"{folder}/{identity}.npz", written)
            except SpecError as error:
                damaged[identity] = f"{error} ({condition}, seed {seed})"
        return damaged

    def save(
        self,
        trial: Planned,
        episodes: Sequence[tuple[object, ...]],
        seconds: Mapping[str, float],
        numbers: Sequence[tuple[str, float, bool]],
        recordings: Mapping[str, Recording],
    ) -> None:
        """Save the result of a trial. It is durable on return.

        Parameters
        ----------
        trial
            The trial.
        episodes
            One row per episode, in the order of `columns`.
        seconds
            Duration of each part, see `SECONDS` [s].
        numbers
            Name, value, and whether repeating the trial gives the same value.
        recordings
            Recorded episodes by name.
        """
        identity = trial.identity
        digest = durable.write_recordings(self._recordings(identity), recordings)
        with transaction(self._db):
            self._replace(trial, "done", None, digest)
            self._insert("episodes", [(identity, *row) for row in episodes])
            self._insert("seconds", [(identity, *(seconds[part] for part in database.SECONDS))])
            self._insert("numbers", [(identity, n, v, int(exact)) for n, v, exact in numbers])
            self._seal(identity)
        with suppress(OSError):
            (self.directory / CHECKPOINTS / f"{identity}.npz").unlink()

    def fail(self, trial: Planned, error: str) -> None:
        """Save the traceback of a failed trial."""
        with transaction(self._db):
            self._replace(trial, "failed", error, None)
            self._seal(trial.identity)

    def forget_failed(self) -> None:
        """Make the failed trials pending again."""
        self._db.execute("DELETE FROM trials WHERE state = 'failed'")

    def recording(self, identity: str, name: str) -> Recording:
        """Return a recorded episode of a trial by its name in `Planned.recorded`, or `TEAM`."""
        query = "SELECT recording_sha256 FROM trials WHERE identity = ?"
        row = self._db.execute(query, (identity,)).fetchone()
        path = self._recordings(identity)
        if row == (None,):
            raise NotRecordedError(f"{path}: does not exist: the trial recorded nothing")
        return durable.read_recording(path, name, *(row or ()))

    def _recordings(self, identity: str) -> Path:
        return self.directory / "recordings" / f"{identity}.npz"

    def _insert(self, table: str, rows: list[tuple[object, ...]]) -> None:
        database.insert(self._db, table, rows)

    def _replace(self, trial: Planned, state: str, error: str | None, digest: str | None) -> None:
        # Table by table: rows of a damaged trial may have lost their parent.
        for table in database.TABLES_OF_TRIALS:
            self._db.execute(f"DELETE FROM {table} WHERE identity = ?", (trial.identity,))
        row = (trial.identity, trial.condition, trial.seed, state, error, digest, self.code_digest)
        self._insert("trials", [row])

    def _seal(self, identity: str) -> None:
        """Save the checksum of a trial's rows."""
        self._insert("checksums", list(trial_checksums(self._db, identity).items()))


@lru_cache(maxsize=64)
def _recorded(text: str) -> dict[int, str]:
    """Return the names of recorded episodes by number, from their JSON text."""
    return {int(number): name for number, name in json.loads(text).items()}
