"""The ledger of a study: a directory that loses nothing that was finished.

``results.sqlite`` holds the spec, the conditions, one row per trial and one per episode;
``recordings/IDENTITY.npz`` the recorded episodes of a trial; ``study.toml`` the spec, to read and
to run again. The database is written through (WAL, synchronous=FULL), and a recording is complete
before its trial is noted as done: a crash at any moment costs the running trials only.

The view `results` is made for other tools::

    pandas.read_sql("SELECT * FROM results", sqlite3.connect("DIR/results.sqlite"))
"""

from __future__ import annotations

import fcntl
import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import durable
from .episodes import COLUMNS, Recording
from .spec import Spec
from .spec_difference import difference
from .spec_errors import SpecError
from .spec_toml import dumps
from .trial import RESULTS_VERSION, Trial, TrialResult

DATABASE = "results.sqlite"
SPEC_FILE = "study.toml"
SECONDS = ("decision", "physics", "sensors", "learning", "total")
SCHEMA = (
    "CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    """CREATE TABLE IF NOT EXISTS trials (
        identity TEXT PRIMARY KEY, condition TEXT NOT NULL, seed INTEGER NOT NULL,
        state TEXT NOT NULL CHECK (state IN ('done', 'failed')), error TEXT,
        recording_sha256 TEXT)""",
    """CREATE TABLE IF NOT EXISTS episodes (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, phase TEXT NOT NULL,
        episode INTEGER NOT NULL, steps INTEGER NOT NULL, success INTEGER NOT NULL,
        stopped_at_goal INTEGER NOT NULL, final_distance_m REAL NOT NULL,
        final_orientation_rad REAL NOT NULL, contact_fraction REAL NOT NULL,
        "return" REAL NOT NULL, PRIMARY KEY (identity, phase, episode)) WITHOUT ROWID""",
    f"""CREATE TABLE IF NOT EXISTS seconds (
        identity TEXT PRIMARY KEY REFERENCES trials ON DELETE CASCADE,
        {", ".join(f"{part} REAL NOT NULL" for part in SECONDS)})""",
    """CREATE TABLE IF NOT EXISTS numbers (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, name TEXT NOT NULL,
        value REAL NOT NULL, repeatable INTEGER NOT NULL, PRIMARY KEY (identity, name))
        WITHOUT ROWID""",
)


class Store:
    """An open study directory. Use `Store.create` to write and `Store.open` to read."""

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        self.directory = directory
        self._db = connection

    @classmethod
    @contextmanager
    def create(cls, directory: Path, spec: Spec) -> Iterator[Store]:
        """Open a directory to run `spec` in; make it if it does not exist.

        Raises
        ------
        SpecError
            If it cannot be written, holds a study that differs by more than additional seeds, or
            another process is writing to it. Nothing has been changed then.
        """
        _refuse_other(directory, spec)
        try:
            (directory / "recordings").mkdir(parents=True, exist_ok=True)
            lock = open(directory / ".lock", "w")  # noqa: SIM115 - held until the store is closed
        except OSError as error:
            raise SpecError(f"{directory}: {error.strerror or error}") from None
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise SpecError(f"{directory}: another process is writing there") from None
            with _connected(directory / DATABASE) as connection:
                connection.execute("PRAGMA journal_mode = WAL")
                connection.execute("PRAGMA synchronous = FULL")
                connection.execute("PRAGMA foreign_keys = ON")
                store = cls(directory, connection)
                store._prepare(spec)
                yield store

    @classmethod
    @contextmanager
    def open(cls, directory: Path) -> Iterator[Store]:
        """Open an existing study to read it.

        Raises
        ------
        SpecError
            If the directory holds no readable study.
        """
        if not (directory / DATABASE).is_file():
            raise SpecError(f"{directory}: holds no study (no {DATABASE})")
        # Not mode=ro: such a connection leaves SQLite's -wal and -shm files behind.
        with _connected(directory / DATABASE, "?mode=rw") as connection:
            connection.execute("PRAGMA query_only = ON")
            yield cls(directory, connection)

    def spec(self) -> Spec:
        """Return the spec that the study runs."""
        return Spec.of(json.loads(self.meta("spec")))

    def meta(self, key: str) -> str:
        """Return what is noted under `key`: ``spec``, ``conditions`` or ``results_version``."""
        found = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        if found is None:
            raise SpecError(f"{self.directory / DATABASE}: is no study: it has no {key}")
        return str(found[0])

    def pending(self, trials: Iterable[Trial]) -> list[Trial]:
        """Return the trials that have neither failed nor finished with an undamaged recording."""
        query = "SELECT identity, state, recording_sha256 FROM trials"
        known = {identity: (state, digest) for identity, state, digest in self._db.execute(query)}

        def settled(identity: str) -> bool:
            state, digest = known.get(identity, ("", None))
            if state == "done":
                return durable.sha256(self._recordings(identity)) == digest
            return state == "failed"

        return [trial for trial in trials if not settled(trial.identity)]

    def save(self, trial: Trial, result: TrialResult, total: float) -> None:
        """Keep the result of a trial that took `total` seconds; durable on return."""
        digest = durable.write_recordings(self._recordings(trial.identity), result.recordings)
        seconds = {**result.seconds, "total": total}
        with self._transaction():
            self._note(trial, "done", None, digest)
            self._insert("episodes", [(trial.identity, *row) for row in result.rows])
            self._insert("seconds", [(trial.identity, *(seconds[part] for part in SECONDS))])
            numbers = [(n, v, 1) for n, v in result.numbers.items()]
            numbers += [(n, v, 0) for n, v in result.usage.items()]
            self._insert("numbers", [(trial.identity, *number) for number in numbers])

    def fail(self, trial: Trial, error: str) -> None:
        """Keep the traceback of a trial that failed."""
        with self._transaction():
            self._note(trial, "failed", error, None)

    def forget_failed(self) -> int:
        """Make the failed trials pending again; return how many."""
        with self._transaction():
            return self._db.execute("DELETE FROM trials WHERE state = 'failed'").rowcount

    def failed(self) -> list[tuple[str, int, str]]:
        """Return condition, seed and traceback of every failed trial."""
        return self._db.execute(
            "SELECT condition, seed, error FROM trials JOIN conditions USING (condition) "
            "WHERE state = 'failed' ORDER BY position, seed"
        ).fetchall()

    def counts(self) -> dict[str, int]:
        """Return how many trials are ``done`` and how many ``failed``."""
        query = "SELECT state, count(*) FROM trials GROUP BY state"
        return {"done": 0, "failed": 0} | dict(self._db.execute(query).fetchall())

    def phases(self) -> list[str]:
        """Return the phases that episodes were run in, training and evaluation first."""
        query = "SELECT DISTINCT phase FROM episodes"
        found = {phase for (phase,) in self._db.execute(query)}
        return sorted(found, key=lambda phase: (phase != "training", phase != "evaluation", phase))

    def rows(self, phase: str = "training") -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and the rows of a phase, by condition, seed and episode."""
        cursor = self._db.execute("SELECT * FROM results WHERE phase = ?", (phase,))
        return [column[0] for column in cursor.description], cursor.fetchall()

    def seconds(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and the seconds of every part of every trial."""
        cursor = self._db.execute(
            f"SELECT condition, seed, {', '.join(SECONDS)} FROM seconds "
            "JOIN trials USING (identity) JOIN conditions USING (condition) ORDER BY position, seed"
        )
        return [column[0] for column in cursor.description], cursor.fetchall()

    def numbers(self) -> list[tuple[str, int, str, float, bool]]:
        """Return condition, seed, name, value and whether it is a function of the trial."""
        cursor = self._db.execute(
            "SELECT condition, seed, name, value, repeatable FROM numbers "
            "JOIN trials USING (identity) JOIN conditions USING (condition) "
            "ORDER BY position, seed, name"
        )
        return [(*row[:4], bool(row[4])) for row in cursor]

    def recording(self, trial: Trial, name: str) -> Recording:
        """Return a recorded episode of a trial, ``first`` or ``last``; see `durable`."""
        return durable.read_recording(self._recordings(trial.identity), name)

    def _recordings(self, identity: str) -> Path:
        return self.directory / "recordings" / f"{identity}.npz"

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._db.execute("ROLLBACK")
            raise
        self._db.execute("COMMIT")

    def _insert(self, table: str, rows: list[tuple[Any, ...]]) -> None:
        if rows:
            places = ", ".join("?" * len(rows[0]))
            self._db.executemany(f"INSERT INTO {table} VALUES ({places})", rows)

    def _note(self, trial: Trial, state: str, error: str | None, digest: str | None) -> None:
        self._db.execute("DELETE FROM trials WHERE identity = ?", (trial.identity,))
        row = (trial.identity, trial.condition, trial.seed, state, error, digest)
        self._insert("trials", [row])

    def _prepare(self, spec: Spec) -> None:
        conditions = spec.conditions()
        settings = {c.label: c.settings.model_dump(mode="json") for c in conditions}
        swept = [_quoted(key) for key in conditions[0].columns]
        columns = ", ".join(["position INTEGER", "condition TEXT PRIMARY KEY", *swept])
        rows = [(i, c.label, *c.columns.values()) for i, c in enumerate(conditions)]
        with self._transaction():
            for statement in SCHEMA:
                self._db.execute(statement)
            self._db.execute(f"CREATE TABLE IF NOT EXISTS conditions ({columns})")
            self._db.execute("DELETE FROM conditions")
            self._insert("conditions", rows)
            self._db.execute(
                f"""CREATE VIEW IF NOT EXISTS results AS
                SELECT c.condition, {"".join(f"c.{key}, " for key in swept)}t.seed,
                    {", ".join(f"e.{_quoted(name)}" for name in COLUMNS)}
                FROM episodes e JOIN trials t USING (identity) JOIN conditions c USING (condition)
                WHERE t.state = 'done' ORDER BY c.position, t.seed, e.phase DESC, e.episode"""
            )
            self._db.execute("DELETE FROM meta")
            meta = {"results_version": str(RESULTS_VERSION), "spec": json.dumps(spec.table())}
            self._insert("meta", [*meta.items(), ("conditions", json.dumps(settings))])
        path = self.directory / SPEC_FILE
        if not (path.exists() and Spec.load(path) == spec):
            durable.write(path, dumps(spec.table()).encode())


def _refuse_other(directory: Path, spec: Spec) -> None:
    """Raise `SpecError` if a directory holds something that `spec` may not be added to."""
    if not _holds_tables(directory):
        if (directory / SPEC_FILE).exists() and Spec.load(directory / SPEC_FILE) != spec:
            raise SpecError(f"{directory / SPEC_FILE}: is in the way of this study's own copy")
        return
    with Store.open(directory) as store:
        if (version := store.meta("results_version")) != str(RESULTS_VERSION):
            raise SpecError(
                f"{directory}: holds results of version {version}, this is version "
                f"{RESULTS_VERSION}; use another directory"
            )
        if found := difference(store.spec(), json.loads(store.meta("conditions")), spec):
            raise SpecError(f"{directory}: holds another study: {found}")


def _holds_tables(directory: Path) -> bool:
    """Tell a study from nothing, and from a run that was killed before it had noted its spec."""
    if not (directory / DATABASE).exists():
        return False
    with Store.open(directory) as store:
        return store._db.execute("SELECT 1 FROM sqlite_master").fetchone() is not None


@contextmanager
def _connected(path: Path, options: str = "") -> Iterator[sqlite3.Connection]:
    uri = path.absolute().as_uri()
    try:
        connection = sqlite3.connect(uri + options, uri=True, isolation_level=None)
        try:
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            if not options:
                raise
            # A finished study on a medium where SQLite cannot make its shared-memory file.
            connection.close()
            connection = sqlite3.connect(f"{uri}?immutable=1", uri=True, isolation_level=None)
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
        try:
            yield connection
        finally:
            connection.close()
    except sqlite3.DatabaseError as error:
        raise SpecError(f"{path}: {error}") from None


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
