"""Tables of a study's database, and the description of the study in them."""

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
"""Name of a study's own copy of its spec, in the folder of the database."""
CHECKPOINTS = "checkpoints"
"""Folder of the checkpoints of running trials, in the folder of the database."""


class NoStudyError(SpecError):
    """A directory holds no study, or its run was killed before it described the study."""


def insert(connection: sqlite3.Connection, table: str, rows: list[tuple[object, ...]]) -> None:
    """Insert whole rows into a table."""
    if rows:
        places = ", ".join("?" * len(rows[0]))
        connection.executemany(f"INSERT INTO {table} VALUES ({places})", rows)


def quote(name: str) -> str:
    """Return a name as a quoted SQL identifier."""
    return '"' + name.replace('"', '""') + '"'


RESULTS_VERSION = 6
"""Raise it when the code changes so that the same trial gives other results."""

STAGE = "training:"
"""Prefix of the phase of a curriculum's stage, before the name of the stage."""
EVALUATION = "evaluation:"
"""Prefix of the phase of a further evaluation, before its name."""
SAMPLED = f"{EVALUATION}sampled actions"
"""Phase of the evaluation with sampled instead of most probable actions."""

BEFORE = ("phase", "episode", "steps")
"""Columns of an episode before its measures."""
AFTER = ("return",)
"""Columns of an episode after its measures."""

SECONDS = ("decision", "physics", "sensors", "learning", "total")
"""Timed parts of a trial."""

TABLES_OF_TRIALS = ("trials", "episodes", "seconds", "numbers", "checksums")
"""Tables with rows of single trials, by identity of the trial."""

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
)
"""Tables that are equal in all studies; the columns of `conditions` and `episodes` differ."""


class Planned(NamedTuple):
    """A trial of a study, before it is run."""

    identity: str
    condition: str
    seed: int
    recorded: dict[int, str]
    """Names of the training episodes that are recorded, by number."""


@dataclass(frozen=True)
class StudyNotes:
    """Description of a study in plain tables, texts and rows, written before anything is run."""

    spec: Mapping[str, Any]
    """The spec as a table."""
    conditions: Mapping[str, Any]
    """The settings of each condition, by label."""
    columns: Mapping[str, Mapping[str, Any]]
    """The swept keys of each condition, by label; all have the same keys."""
    sources: Mapping[str, str]
    """Texts of the users' files that the spec names, by name."""
    measures: Sequence[Measure] = ()
    """Measures of an episode."""
    planned: Sequence[Planned] = ()
    """All trials of the study."""
    code: Mapping[str, str] = field(default_factory=dict)
    """Digests of the installed code, by module."""

    @property
    def code_digest(self) -> str:
        """One short digest of all modules."""
        text = "".join(f"{name} {digest} " for name, digest in sorted(self.code.items()))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def columns(measures: Iterable[Measure]) -> tuple[str, ...]:
    """Return the columns of an episode: phase and length, its measures, its return."""
    return (*BEFORE, *(measure.name for measure in measures), *AFTER)


def tables(measures: Iterable[Measure]) -> list[dict[str, Any]]:
    """Return measures as tables for JSON."""
    return [asdict(measure) for measure in measures]


def measures_from(tables: Iterable[Mapping[str, Any]]) -> tuple[Measure, ...]:
    """Return the measures that `tables` converted.

    Raises
    ------
    TypeError
        If a table does not describe a measure.
    """
    return tuple(Measure(**table) for table in tables)


def prepare(db: sqlite3.Connection, notes: StudyNotes) -> None:
    """Create the tables and describe the study and its code, within a transaction."""
    swept = [quote(key) for key in next(iter(notes.columns.values()))]
    definitions = ", ".join(["position INTEGER", "condition TEXT PRIMARY KEY", *swept])
    for statement in SCHEMA:
        db.execute(statement)
    # A measure is NULL where a scenario does not have it.
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
