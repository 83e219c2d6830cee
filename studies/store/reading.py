"""What the database of a study holds, as rows and words; nothing is written here."""

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from ...core.interface.scenario import Measure
from ..errors import SpecError
from . import database, integrity
from .database import DATABASE
from .schema import (
    EVALUATION,
    PLANNED,
    SECONDS,
    STAGE,
    Noted,
    Planned,
    measures_from,
    trial_checksums,
)

NamesAndRows = tuple[list[str], Iterable[tuple[Any, ...]]]
"""The names of columns, and rows of values, which may be read one by one."""


class Reading:
    """The rows of an open study; see `open`.

    Attributes
    ----------
    directory
        Where the study is.
    """

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        self.directory = directory
        self._db = connection

    @classmethod
    @contextmanager
    def open(cls, directory: Path) -> Iterator[Self]:
        """Open an existing study to read one state of it, whatever is added meanwhile.

        Raises
        ------
        SpecError
            If the directory holds no readable study, or one of another version, or its database is
            damaged as a whole: what it says of the study, or the number of its trials. For their
            rows see `verify`.
        """
        path = directory / DATABASE
        if integrity.is_orphaned(path):
            raise SpecError(
                f"{path}-wal: is the log of a database that is not there any more; nested-agents "
                "run sets it aside"
            )
        if not path.is_file():
            raise SpecError(f"{directory}: holds no study (no {DATABASE})")
        with database.reading(path) as connection:
            if (wrong := integrity.fault(path, connection)) is not None:
                raise database.DamageError(path, wrong)
            if connection.execute("SELECT 1 FROM sqlite_master").fetchone() is None:
                raise SpecError(f"{path}: is empty, it holds no study yet")
            yield cls(directory, connection)

    def spec(self) -> Mapping[str, Any]:
        """Return the table of the spec that the study runs."""
        return self._table("spec")

    def sources(self) -> dict[str, str]:
        """Return by name the texts of the users' files that the study names, when it began."""
        return self._table("sources")

    def settings(self) -> dict[str, Any]:
        """Return the settings of each condition by label, as they were when it began."""
        return self._table("conditions")

    def planned(self) -> tuple[Planned, ...]:
        """Return all trials of the study, as they were noted."""
        rows = self._db.execute(f"SELECT {', '.join(PLANNED)} FROM planned ORDER BY position")
        return tuple(
            Planned(identity, condition, seed, {int(k): v for k, v in json.loads(kept).items()})
            for identity, condition, seed, kept in rows
        )

    def versions_of_code(self) -> int:
        """Return by how many versions of the installed code finished trials were computed."""
        query = "SELECT count(DISTINCT code) FROM trials WHERE state = 'done'"
        return int(self._db.execute(query).fetchone()[0])

    def code(self) -> dict[str, tuple[str, str]]:
        """Return by module two digests of the code that computed what was added last."""
        return {name: (text, tree) for name, (text, tree) in self._table("code").items()}

    def noted(self) -> Noted:
        """Return what the study is, but for its trials and code."""
        return Noted(self.spec(), self.settings(), self.columns(), self.sources(), self.measures())

    def measures(self) -> tuple[Measure, ...]:
        """Return what the study measures of its episodes, of any condition."""
        try:
            return measures_from(json.loads(self.meta("measures")))
        except (ValueError, TypeError):
            raise SpecError(
                f"{self.directory / DATABASE}: is damaged: measures cannot be read"
            ) from None

    def meta(self, key: str) -> str:
        """Return what is noted under `key`, as ``spec`` or ``conditions``."""
        row = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        if row is None:
            raise SpecError(f"{self.directory / DATABASE}: is no study: it has no {key}")
        return str(row[0])

    def _table(self, key: str) -> dict[str, Any]:
        try:
            table = json.loads(self.meta(key))
        except ValueError:
            table = None
        if not isinstance(table, dict):
            raise SpecError(f"{self.directory / DATABASE}: is damaged: {key} cannot be read")
        return table

    def verify(self) -> None:
        """Raise `SpecError` if the rows of a trial that was run are not what was written."""
        for where in self._damaged_rows().values():
            raise SpecError(f"{where}; nested-agents run runs it again")

    def _damaged_rows(self) -> dict[str, str]:
        """Return by identity whose rows are not what was written, one line each."""
        noted = dict(self._db.execute("SELECT identity, sha256 FROM checksums").fetchall())
        names = {
            identity: f"{condition}, seed {seed}"
            for table in ("trials", "planned")
            for identity, condition, seed in self._db.execute(
                f"SELECT identity, condition, seed FROM {table}"
            )
        }
        actual = dict(trial_checksums(self._db))
        path = self.directory / DATABASE
        return {
            identity: f"{path}: {names.get(identity, identity)}: rows are damaged"
            for identity in actual | noted
            if identity not in actual or noted.get(identity, actual[identity]) != actual[identity]
        }

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
        stages = [phase for phase in recorded if phase.startswith(STAGE)]
        evaluations = [f"{EVALUATION}{name}" for name in self._table("spec").get("evaluations", ())]
        ordered = [*known, *stages, *evaluations]
        return [phase for phase in ordered if phase in recorded] + sorted({*recorded} - {*ordered})

    def columns(self) -> dict[str, dict[str, Any]]:
        """Return what tells each condition from the others, by label; see `Condition`."""
        cursor = self._db.execute("SELECT * FROM conditions ORDER BY position")
        swept = [column[0] for column in cursor.description][2:]
        return {row[1]: dict(zip(swept, row[2:], strict=True)) for row in cursor}

    def episodes(self) -> tuple[list[str], Iterator[tuple[Any, ...]]]:
        """Return the column names and the rows of all phases, by condition, seed and episode.

        Rows are read one by one, as long as the study is open: there may be millions.
        """
        cursor = self._db.execute("SELECT * FROM results")
        return [column[0] for column in cursor.description], cursor

    def trials(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and one row per trial, by condition and seed.

        After the swept keys and the seed: its state, its identity, the last line of its traceback
        if it failed, the seconds of each part, and its `numbers`; None where there is no such.
        """
        swept = next(iter(self.columns().values()), {})
        names = [n for (n,) in self._db.execute("SELECT DISTINCT name FROM numbers ORDER BY name")]
        values = {
            (i, n): v for i, n, v in self._db.execute("SELECT identity, name, value FROM numbers")
        }
        cursor = self._db.execute(
            f"SELECT c.condition, {''.join(f'c.{database.quoted(key)}, ' for key in swept)}seed, "
            f"state, identity, error, {', '.join(SECONDS)} FROM trials "
            "JOIN conditions c USING (condition) LEFT JOIN seconds USING (identity) "
            "ORDER BY position, seed"
        )
        columns = [column[0] for column in cursor.description]
        identity, error = columns.index("identity"), columns.index("error")
        rows = []
        for row in cursor:
            last = (row[error] or "").rstrip().rpartition("\n")[2] or None
            measured = (values.get((row[identity], name)) for name in names)
            rows.append((*row[:error], last, *row[error + 1 :], *measured))
        return [*columns[: -len(SECONDS)], *(f"seconds.{part}" for part in SECONDS), *names], rows

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
