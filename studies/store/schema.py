"""The tables of a study's database, and checksums of what they hold.

SQLite notices a torn page but not a flipped digit. Each trial that was run therefore has a checksum
of its rows, and what concerns the study as a whole has another one, in `meta`. The table `ledger`
says how many trials have been run, so that none can be gone unnoticed.
"""

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple

from ...core.interface.scenario import Measure
from .database import insert, quoted

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

PLANNED = ("identity", "condition", "seed", "recorded")
"""What is noted of every trial of a study before it is run."""

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
    db.execute(_episodes(noted.measures))
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
    meta = {"results_version": str(RESULTS_VERSION), "spec": json.dumps(noted.spec)}
    meta |= {"conditions": json.dumps(noted.conditions)}
    meta |= {"measures": json.dumps(tables(noted.measures))}
    meta |= {"sources": json.dumps(noted.sources), "code": json.dumps(noted.code)}
    insert(db, "meta", list(meta.items()))
    insert(db, "meta", [("sha256", study_checksum(db))])
    if db.execute("SELECT 1 FROM ledger").fetchone() is None:
        db.execute("INSERT INTO ledger VALUES (0)")


def _episodes(measures: Sequence[Measure]) -> str:
    """Return what makes the table of episodes: a measure is NULL where a scenario has it not."""
    measured = "".join(f"{quoted(m.name)} {'INTEGER' if m.is_rate else 'REAL'}, " for m in measures)
    return f"""CREATE TABLE IF NOT EXISTS episodes (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, phase TEXT NOT NULL,
        episode INTEGER NOT NULL, steps INTEGER NOT NULL, {measured}"return" REAL NOT NULL,
        PRIMARY KEY (identity, phase, episode)) WITHOUT ROWID"""


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
    trials = _by_identity(
        db,
        "trials",
        "identity, condition, seed, state, recording_sha256, code, error",
        "",
        identity,
    )
    # Only what failed has a traceback; that of a finished trial is no part of its checksum.
    first = {key: [r[:-1] if r[-1] is None else r for r in rows] for key, rows in trials}
    seconds, numbers = (
        {key: list(rows) for key, rows in _by_identity(db, table, "*", order, identity)}
        for table, order in (("seconds", ""), ("numbers", ", name"))
    )
    left = dict.fromkeys((*first, *seconds, *numbers))
    for key, rows in _by_identity(db, "episodes", "*", ", phase, episode", identity):
        left.pop(key, None)
        parts = first.get(key, []), list(rows), seconds.get(key, []), numbers.get(key, [])
        yield key, _sha256(parts)
    for key in left:
        yield key, _sha256((first.get(key, []), [], seconds.get(key, []), numbers.get(key, [])))


def _by_identity(
    db: sqlite3.Connection, table: str, columns: str, order: str, identity: str | None
) -> Iterator[tuple[str, Iterable[tuple[Any, ...]]]]:
    where, values = ("", ()) if identity is None else ("WHERE identity = ?", (identity,))
    query = f"SELECT {columns} FROM {table} {where} ORDER BY identity{order}"
    return groupby(db.execute(query, values), itemgetter(0))


ENCODER = json.JSONEncoder(check_circular=False, default=repr)
"""Writes rows as text. A flipped type makes bytes of a text: hence the default."""


def _sha256(content: object) -> str:
    return hashlib.sha256(ENCODER.encode(content).encode()).hexdigest()
