"""The database of a study: connections, tables, checksums, and what is done if it is damaged.

It is written through, and errors are one line. SQLite notices a torn page but not a flipped digit.
Each trial that was run therefore has a checksum of its rows, and what concerns the study as a whole
has another one, in `meta`. The table `ledger` says how many trials have been run, so that none can
be gone unnoticed. A damaged database is set aside, and what can be trusted of it taken over.
"""

import hashlib
import json
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import chain, count, groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from ...core.interface.measures import Measure
from ..errors import SpecError

DATABASE = "results.sqlite"
"""Name of the file, in the directory of a study."""
SPEC_FILE = "study.toml"
"""Name of a study's own copy of its spec, beside it."""

CIRCUMSTANCES = (
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_NOMEM,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_CANTOPEN,
)
"""Errors that are no fault of the database; all others are: our statements fit our tables."""

ILL = (UnicodeError, MemoryError, OverflowError)
"""What Python itself raises when SQLite hands it damaged text or sizes."""


class NoStudyError(SpecError):
    """A directory holds no study, or only what a run left that was killed before it noted one."""

    reason = None


class DamageError(SpecError):
    """A database holds something else than was written.

    Attributes
    ----------
    reason
        What is wrong with it.
    """

    def __init__(self, path: Path, reason: str, message: str = "") -> None:
        usual = f"{path}: is damaged: {reason}; nested-agents run mends it"
        super().__init__(message or usual)
        self.reason = reason


@contextmanager
def writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to write, and make the database if there is none; see `reading`.

    Raises
    ------
    DamageError
        If the database is damaged.
    SpecError
        If it cannot be used, or the disk is full.
    """
    with _one_line(path), closing(_connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        yield connection


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to an existing database to read one state of it, also where nothing can be written.

    Raises
    ------
    DamageError
        If the database is damaged.
    SpecError
        If it cannot be read.
    """
    # Not mode=ro: such a connection leaves SQLite's -wal and -shm files behind.
    uri = f"{path.absolute().as_uri()}?mode=rw"
    with _one_line(path), closing(_connect(uri, uri=True, isolation_level=None)) as connection:
        try:
            connection.execute("BEGIN")
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            connection.close()
            with copied(path) as copy:
                yield copy
            return
        except ILL as error:
            raise DamageError(path, " ".join(str(error).split())) from None
        connection.execute("PRAGMA query_only = ON")
        yield connection


@contextmanager
def copied(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to a copy of a database, its log included, and leave the original as it is.

    SQLite itself reads no log where it cannot make a file, as on a full disk.
    """
    with tempfile.TemporaryDirectory() as folder:
        for suffix in ("", "-wal"):
            source = path.with_name(path.name + suffix)
            if source.exists():
                shutil.copyfile(source, Path(folder) / source.name)
        with closing(_connect(Path(folder) / path.name)) as connection:
            yield connection


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Keep all that is written in the context, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    with connection:  # which commits, or rolls back what SQLite has not when the disk is full
        yield


def insert(connection: sqlite3.Connection, table: str, rows: list[tuple[object, ...]]) -> None:
    """Insert whole rows into a table."""
    if rows:
        places = ", ".join("?" * len(rows[0]))
        connection.executemany(f"INSERT INTO {table} VALUES ({places})", rows)


def quoted(name: str) -> str:
    """Return a name as SQL takes any name."""
    return '"' + name.replace('"', '""') + '"'


def _connect(database: Path | str, **options: Any) -> sqlite3.Connection:
    connection = sqlite3.connect(database, **options)
    # A flipped bit may make text that is no UTF-8; checksums tell, decoding need not.
    connection.text_factory = partial(str, encoding="utf-8", errors="replace")
    return connection


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
    """Raise errors of a database as one line; it and the files beside it must be files."""
    for suffix in ("", "-wal", "-shm"):
        beside = path.with_name(path.name + suffix)
        if os.path.lexists(beside) and not beside.is_file():
            raise SpecError(f"{beside}: is no file, and in the way of one; remove it")
    try:
        yield
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if code == sqlite3.SQLITE_IOERR:  # all it says when the disk is full at some places
            free = shutil.disk_usage(path.parent).free
            raise SpecError(f"{path}: {error}, {free // 1000} kB free on this disk") from None
        if code in CIRCUMSTANCES:
            raise SpecError(f"{path}: {error}") from None
        raise DamageError(path, str(error)) from None


RESULTS_VERSION = 4
"""Raise it when the code changes so that the same trial gives other results."""

STAGE = "training:"
"""With what the phase of a stage of a curriculum begins; the stage's name follows."""
EVALUATION = "evaluation:"
"""With what the phase of an evaluation beside a trial's own begins; its name follows."""

BEFORE = ("phase", "episode", "steps")
"""The columns of an episode before its measures."""
AFTER = ("return",)
"""Those after them."""

SECONDS = ("decision", "physics", "sensors", "learning", "total")

OF_A_TRIAL = ("episodes", "seconds", "numbers", "checksums")
"""The tables that hold what a trial measured, by its identity."""

SCHEMA = (
    "CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    """CREATE TABLE IF NOT EXISTS trials (
        identity TEXT PRIMARY KEY, condition TEXT NOT NULL, seed INTEGER NOT NULL,
        state TEXT NOT NULL CHECK (state IN ('done', 'failed')), error TEXT,
        recording_sha256 TEXT, code TEXT)""",
    """CREATE TABLE IF NOT EXISTS planned (
        position INTEGER, identity TEXT PRIMARY KEY, condition TEXT NOT NULL,
        seed INTEGER NOT NULL, recorded TEXT NOT NULL)""",
    f"""CREATE TABLE IF NOT EXISTS seconds (
        identity TEXT PRIMARY KEY REFERENCES trials ON DELETE CASCADE,
        {", ".join(f"{part} REAL NOT NULL" for part in SECONDS)})""",
    """CREATE TABLE IF NOT EXISTS numbers (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, name TEXT NOT NULL,
        value REAL NOT NULL, repeatable INTEGER NOT NULL, PRIMARY KEY (identity, name))
        WITHOUT ROWID""",
    """CREATE TABLE IF NOT EXISTS checksums (
        identity TEXT PRIMARY KEY REFERENCES trials ON DELETE CASCADE, sha256 TEXT NOT NULL)""",
    "CREATE TABLE IF NOT EXISTS ledger (trials INTEGER NOT NULL)",
)
"""Tables that studies have alike; beside them are `conditions` and `episodes`, whose columns
differ."""


class Planned(NamedTuple):
    """A trial as it is noted before it is run."""

    identity: str
    condition: str
    seed: int
    recorded: dict[int, str]
    """Names of the training episodes that are recorded, by number."""


@dataclass(frozen=True)
class Noted:
    """What a study is, in plain tables, texts and rows, as it is noted before anything is run."""

    spec: Mapping[str, Any]
    """The spec as a table."""
    conditions: Mapping[str, Any]
    """The settings of each condition, by label."""
    columns: Mapping[str, Mapping[str, Any]]
    """What tells each condition from the others, by label; all have the same keys."""
    sources: Mapping[str, str]
    """The texts of the files of users that it names, by name."""
    measures: Sequence[Measure] = ()
    """What it measures of its episodes."""
    planned: Sequence[Planned] = ()
    """All its trials."""
    code: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """By module, two digests of the code that computes what is added."""

    @property
    def code_digest(self) -> str:
        """One short digest of what all modules mean."""
        text = "".join(f"{name} {tree} " for name, (_, tree) in sorted(self.code.items()))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def columns(measures: Iterable[Measure]) -> tuple[str, ...]:
    """Return the columns of an episode: where it stands, its measures, its return."""
    return (*BEFORE, *(measure.name for measure in measures), *AFTER)


def tables(measures: Iterable[Measure]) -> list[dict[str, Any]]:
    """Return measures as tables, fit for JSON."""
    return [asdict(measure) for measure in measures]


def measures_from(tables: Iterable[Mapping[str, Any]]) -> tuple[Measure, ...]:
    """Return what `tables` was given.

    Raises
    ------
    TypeError
        If the tables are of something else.
    """
    return tuple(Measure(**table) for table in tables)


def prepare(db: sqlite3.Connection, noted: Noted) -> None:
    """Make the tables, and note what the study is and what computes it; within a transaction."""
    swept = [quoted(key) for key in next(iter(noted.columns.values()))]
    definitions = ", ".join(["position INTEGER", "condition TEXT PRIMARY KEY", *swept])
    for statement in SCHEMA:
        db.execute(statement)
    # A measure is NULL where a scenario has it not.
    kinds = ((quoted(m.name), "INTEGER" if m.is_rate else "REAL") for m in noted.measures)
    measured = "".join(f"{name} {kind}, " for name, kind in kinds)
    db.execute(
        f"""CREATE TABLE IF NOT EXISTS episodes (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, phase TEXT NOT NULL,
        episode INTEGER NOT NULL, steps INTEGER NOT NULL, {measured}"return" REAL NOT NULL,
        PRIMARY KEY (identity, phase, episode)) WITHOUT ROWID"""
    )
    db.execute(f"CREATE TABLE IF NOT EXISTS conditions ({definitions})")
    db.execute("DELETE FROM conditions")
    by_condition = enumerate(noted.columns.items())
    insert(db, "conditions", [(i, label, *row.values()) for i, (label, row) in by_condition])
    stage = f"e.phase GLOB '{STAGE}*'"  # stages come first, in the order in which they are trained
    db.execute(
        f"""CREATE VIEW IF NOT EXISTS results AS
        SELECT c.condition, {"".join(f"c.{key}, " for key in swept)}t.seed,
            {", ".join(f"e.{quoted(name)}" for name in columns(noted.measures))}
        FROM episodes e JOIN trials t USING (identity) JOIN conditions c USING (condition)
        WHERE t.state = 'done' ORDER BY c.position, t.seed, {stage} DESC,
            CASE WHEN {stage} THEN e.episode END, e.phase DESC, e.episode"""
    )
    db.execute("DELETE FROM planned")
    planned: list[tuple[object, ...]] = [
        (i, *trial[:-1], json.dumps(trial.recorded)) for i, trial in enumerate(noted.planned)
    ]
    insert(db, "planned", planned)
    db.execute("DELETE FROM meta")
    meta = {"results_version": RESULTS_VERSION, "measures": tables(noted.measures)}
    meta |= {k: getattr(noted, k) for k in ("spec", "conditions", "sources", "code")}
    insert(db, "meta", [(key, json.dumps(value)) for key, value in meta.items()])
    insert(db, "meta", [("sha256", study_checksum(db))])
    if db.execute("SELECT 1 FROM ledger").fetchone() is None:
        db.execute("INSERT INTO ledger VALUES (0)")


def study_checksum(db: sqlite3.Connection) -> str:
    """Return the SHA-256 of what the database says of the study as a whole."""
    queries = (
        "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY name",
        "SELECT key, value FROM meta WHERE key <> 'sha256' ORDER BY key",
        "SELECT * FROM conditions ORDER BY condition",
        "SELECT * FROM planned ORDER BY position",
    )
    return _sha256([db.execute(query).fetchall() for query in queries])


def trial_checksums(
    db: sqlite3.Connection, identity: str | None = None
) -> Iterator[tuple[str, str]]:
    """Yield the SHA-256 of all rows of each trial, or of one alone, after its identity.

    What has rows in any table counts as a trial. Tables are read from end to end, as asking for
    each of many trials on its own takes longer.
    """
    columns = "identity, condition, seed, state, recording_sha256, code, error"
    trials = _by_identity(db, identity, "trials", columns=columns)
    # Only what failed has a traceback; that of a finished trial is no part of its checksum.
    first = {key: [r[:-1] if r[-1] is None else r for r in rows] for key, rows in trials}
    seconds = {key: list(rows) for key, rows in _by_identity(db, identity, "seconds")}
    numbers = {key: list(rows) for key, rows in _by_identity(db, identity, "numbers", ", name")}
    seen: set[str] = set()
    without: Rows = ((key, ()) for key in first | seconds | numbers if key not in seen)
    for key, rows in chain(_by_identity(db, identity, "episodes", ", phase, episode"), without):
        seen.add(key)
        parts = first.get(key, []), list(rows), seconds.get(key, []), numbers.get(key, [])
        yield key, _sha256(parts)


Rows = Iterator[tuple[str, Iterable[tuple[Any, ...]]]]
"""The identity of each trial, with its rows of a table."""


def _by_identity(
    db: sqlite3.Connection, identity: str | None, table: str, order: str = "", columns: str = "*"
) -> Rows:
    where, values = ("", ()) if identity is None else ("WHERE identity = ?", (identity,))
    query = f"SELECT {columns} FROM {table} {where} ORDER BY identity{order}"
    return groupby(db.execute(query, values), itemgetter(0))


ENCODER = json.JSONEncoder(check_circular=False, default=repr)
"""Writes rows as text. A flipped type makes bytes of a text: hence the default."""


def _sha256(content: object) -> str:
    return hashlib.sha256(ENCODER.encode(content).encode()).hexdigest()


def is_orphaned(path: Path) -> bool:
    """Tell whether only the log is left of a database: SQLite would drop it without a word."""
    files = path.with_name(f"{path.name}-wal"), path
    log_size, size = (file.stat().st_size if file.exists() else 0 for file in files)
    return log_size > 0 and size == 0


def fault(path: Path, db: sqlite3.Connection) -> str | None:
    """Return what is wrong with an open database as a whole; None if nothing is.

    Raises
    ------
    NoStudyError
        If it is empty.
    SpecError
        If it is of another version, or is no study's.
    """
    try:
        tables = {name for (name,) in db.execute("SELECT name FROM sqlite_master")}
        if not tables:
            (pages,) = db.execute("PRAGMA page_count").fetchone()
            if pages > 1:
                return "it has no tables"
            raise NoStudyError(f"{path}: is empty, it holds no study yet")
        if not tables & {"meta", "trials", *OF_A_TRIAL}:
            raise SpecError(f"{path}: is a database, but no study; use another directory")
        (answer,) = db.execute("PRAGMA integrity_check(1)").fetchone()
        if answer != "ok":
            return " ".join(str(answer).replace("*** in database main ***", "").split())
        noted = dict(db.execute("SELECT key, value FROM meta").fetchall())
        version = str(noted.get("results_version"))
        # Checksums of another version may be others.
        if version.isdecimal() and int(version) != RESULTS_VERSION:
            is_newer = int(version) > RESULTS_VERSION
            raise SpecError(
                f"{path}: holds results of version {version}, this is version {RESULTS_VERSION}; "
                f"{'a newer' if is_newer else 'an older'} nested-agents reads it"
            )
        if noted.get("sha256") != study_checksum(db):
            return "what it says of the study is not what was written"
        kept = db.execute("SELECT count(*) FROM checksums").fetchall()
        if db.execute("SELECT trials FROM ledger").fetchall() != kept:
            return "it does not hold as many trials as were run"
    except ILL as error:
        return " ".join(str(error).split()) or type(error).__name__
    return None


def set_aside(path: Path) -> Path:
    """Give a database, with its log, a name that nothing else has; return it."""
    names = (path.with_name(f"{path.name}.damaged-{number}") for number in count(1))
    aside = next(name for name in names if not name.exists())
    # The database last: if this is interrupted, it is found damaged once more.
    for suffix in ("-wal", ""):
        old = path.with_name(path.name + suffix)
        if old.exists():
            os.replace(old, aside.with_name(aside.name + suffix))
    path.with_name(f"{path.name}-shm").unlink(missing_ok=True)
    return aside


def recover(damaged: Path, db: sqlite3.Connection) -> int:
    """Copy the trials whose rows are what was written; within a transaction.

    Parameters
    ----------
    damaged
        A database that was set aside.
    db
        The new one, which has tables but no trials.

    Returns
    -------
    int
        How many trials were copied; none if episodes have other measures now.
    """
    identities: dict[str, str] = {}
    taken_over = 0
    with copied(damaged) as old:
        with suppress(sqlite3.Error, *ILL):
            # A table that it cannot understand is passed over.
            old.execute("PRAGMA writable_schema = ON")
            noted_by = old.execute("SELECT identity, sha256 FROM checksums")
            for identity, noted in noted_by if _columns(old) == _columns(db) else ():
                identities.setdefault(identity, noted)
        for identity, noted in identities.items():
            try:
                if dict(trial_checksums(old, identity)) != {identity: noted}:
                    continue
                query = "SELECT * FROM {} WHERE identity = ?"
                tables = {
                    table: old.execute(query.format(table), (identity,)).fetchall()
                    for table in ("trials", *OF_A_TRIAL)
                }
            except (sqlite3.Error, *ILL):
                continue
            # The row that an index leads to may be another one.
            tables["checksums"] = [(identity, noted)]
            for table, rows in tables.items():
                insert(db, table, rows)
            taken_over += 1
    db.execute("UPDATE ledger SET trials = ?", (taken_over,))
    return taken_over


def _columns(db: sqlite3.Connection) -> list[str]:
    return [name for _, name, *_ in db.execute("PRAGMA table_info(episodes)")]
