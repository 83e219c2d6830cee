"""The tables of a study's database, and checksums of what they hold.

SQLite notices a torn page but not a flipped digit. Each trial that was run therefore has a checksum
of its rows, and what concerns the study as a whole has another one, in `meta`. The table `ledger`
says how many trials have been run, so that none can be gone unnoticed.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from ...core.interface.measures import Measure
from ..trials.code import RESULTS_VERSION, Code
from ..trials.episodes import STAGE
from ..trials.measures import columns, tables
from .database import insert, quoted

if TYPE_CHECKING:
    from ..spec.spec import Spec

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


def prepare(
    db: sqlite3.Connection, spec: Spec, measures: Sequence[Measure], computed_by: Code
) -> None:
    """Make the tables, and note what the study is and what computes it; within a transaction."""
    from ..trials.trial import trials_of

    conditions = spec.conditions()
    settings = {c.label: c.settings.model_dump(mode="json") for c in conditions}
    swept = [quoted(key) for key in conditions[0].columns]
    told = ", ".join(["position INTEGER", "condition TEXT PRIMARY KEY", *swept])
    for statement in SCHEMA:
        db.execute(statement)
    db.execute(_episodes(measures))
    db.execute(f"CREATE TABLE IF NOT EXISTS conditions ({told})")
    db.execute("DELETE FROM conditions")
    insert(db, "conditions", [(i, c.label, *c.columns.values()) for i, c in enumerate(conditions)])
    stage = f"e.phase GLOB '{STAGE}*'"  # stages come first, in the order in which they are trained
    db.execute(
        f"""CREATE VIEW IF NOT EXISTS results AS
        SELECT c.condition, {"".join(f"c.{key}, " for key in swept)}t.seed,
            {", ".join(f"e.{quoted(name)}" for name in columns(measures))}
        FROM episodes e JOIN trials t USING (identity) JOIN conditions c USING (condition)
        WHERE t.state = 'done' ORDER BY c.position, t.seed, {stage} DESC,
            CASE WHEN {stage} THEN e.episode END, e.phase DESC, e.episode"""
    )
    db.execute("DELETE FROM planned")
    planned: list[tuple[object, ...]] = [
        (i, t.identity, t.condition, t.seed, json.dumps(t.recorded))
        for i, t in enumerate(trials_of(spec))
    ]
    insert(db, "planned", planned)
    db.execute("DELETE FROM meta")
    meta = {"results_version": str(RESULTS_VERSION), "spec": json.dumps(spec.table())}
    meta |= {"conditions": json.dumps(settings), "measures": json.dumps(tables(measures))}
    meta |= {"sources": json.dumps(spec.sources.texts), "code": json.dumps(computed_by)}
    insert(db, "meta", list(meta.items()))
    insert(db, "meta", [("sha256", study_checksum(db))])
    if db.execute("SELECT 1 FROM ledger").fetchone() is None:
        # A study begun before there was a ledger: what has a checksum is what there is.
        db.execute("INSERT INTO ledger SELECT count(*) FROM checksums")


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
