"""The tables of a study's database, and what is noted in them before anything is run.

SQLite notices a torn page but not a flipped digit. Each trial that was run therefore has a checksum
of its rows, and what concerns the study as a whole has another one, in `meta`. The table `ledger`
says how many trials have been run, so that none can be gone unnoticed.
"""

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

from ...core.interface.measures import Measure
from ..errors import SpecError
from .checksums import study_checksum

DATABASE = "results.sqlite"
"""Name of the file, in the directory of a study."""
SPEC_FILE = "study.toml"
"""Name of a study's own copy of its spec, beside it."""
CHECKPOINTS = "checkpoints"
"""Folder of what trials under way have come to, beside it."""


class NoStudyError(SpecError):
    """A directory holds no study, or only what a run left that was killed before it noted one."""

    reason = None


def insert(connection: sqlite3.Connection, table: str, rows: list[tuple[object, ...]]) -> None:
    """Insert whole rows into a table."""
    if rows:
        places = ", ".join("?" * len(rows[0]))
        connection.executemany(f"INSERT INTO {table} VALUES ({places})", rows)


def quote(name: str) -> str:
    """Return a name as SQL takes any name."""
    return '"' + name.replace('"', '""') + '"'


RESULTS_VERSION = 5
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
class StudyNotes:
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


def is_empty(db: sqlite3.Connection) -> bool:
    """Tell whether a database has no tables."""
    return db.execute("SELECT 1 FROM sqlite_master").fetchone() is None


def prepare(db: sqlite3.Connection, notes: StudyNotes) -> None:
    """Make the tables, and note what the study is and what computes it; within a transaction."""
    swept = [quote(key) for key in next(iter(notes.columns.values()))]
    definitions = ", ".join(["position INTEGER", "condition TEXT PRIMARY KEY", *swept])
    for statement in SCHEMA:
        db.execute(statement)
    # A measure is NULL where a scenario has it not.
    kinds = ((quote(m.name), "INTEGER" if m.is_rate else "REAL") for m in notes.measures)
    measured = "".join(f"{name} {kind}, " for name, kind in kinds)
    db.execute(
        f"""CREATE TABLE IF NOT EXISTS episodes (
        identity TEXT NOT NULL REFERENCES trials ON DELETE CASCADE, phase TEXT NOT NULL,
        episode INTEGER NOT NULL, steps INTEGER NOT NULL, {measured}"return" REAL NOT NULL,
        PRIMARY KEY (identity, phase, episode)) WITHOUT ROWID"""
    )
    db.execute(f"CREATE TABLE IF NOT EXISTS conditions ({definitions})")
    db.execute("DELETE FROM conditions")
    by_condition = enumerate(notes.columns.items())
    insert(db, "conditions", [(i, label, *row.values()) for i, (label, row) in by_condition])
    stage = f"e.phase GLOB '{STAGE}*'"  # stages come first, in the order in which they are trained
    db.execute(
        f"""CREATE VIEW IF NOT EXISTS results AS
        SELECT c.condition, {"".join(f"c.{key}, " for key in swept)}t.seed,
            {", ".join(f"e.{quote(name)}" for name in columns(notes.measures))}
        FROM episodes e JOIN trials t USING (identity) JOIN conditions c USING (condition)
        WHERE t.state = 'done' ORDER BY c.position, t.seed, {stage} DESC,
            CASE WHEN {stage} THEN e.episode END, e.phase DESC, e.episode"""
    )
    db.execute("DELETE FROM planned")
    planned: list[tuple[object, ...]] = [
        (i, *trial[:-1], json.dumps(trial.recorded)) for i, trial in enumerate(notes.planned)
    ]
    insert(db, "planned", planned)
    db.execute("DELETE FROM meta")
    meta: dict[str, object] = {"results_version": RESULTS_VERSION}
    meta["measures"] = tables(notes.measures)
    meta |= {"spec": notes.spec, "conditions": notes.conditions}
    meta |= {"sources": notes.sources, "code": notes.code}
    insert(db, "meta", [(key, json.dumps(value)) for key, value in meta.items()])
    insert(db, "meta", [("sha256", study_checksum(db))])
    if db.execute("SELECT 1 FROM ledger").fetchone() is None:
        db.execute("INSERT INTO ledger VALUES (0)")
