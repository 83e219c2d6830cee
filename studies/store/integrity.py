"""A damaged database: noticed, set aside, and what can be trusted of it taken over."""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import SpecError
from . import database
from .schema import OF_A_TRIAL, RESULTS_VERSION, study_checksum, trial_checksums


def damage(path: Path) -> str | None:
    """Return what is wrong with a database as a whole; None if nothing is, or it is empty.

    Raises
    ------
    SpecError
        If it cannot be read for another reason, is of another version, or is no study's.
    """
    if is_orphaned(path):
        return "its log is there without it"
    if not path.exists():
        return None
    try:
        with database.reading(path) as db:
            return fault(path, db)
    except database.DamageError as error:
        return error.reason


def is_orphaned(path: Path) -> bool:
    """Tell whether only the log is left of a database: SQLite would drop it without a word."""
    log = path.with_name(f"{path.name}-wal")
    return _size(log) > 0 and _size(path) == 0


def holds_tables(path: Path) -> bool:
    """Tell a study from nothing, and from a run that was killed before it had noted its spec."""
    if not path.exists():
        return False
    with database.reading(path) as db:
        return db.execute("SELECT 1 FROM sqlite_master").fetchone() is not None


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def fault(path: Path, db: sqlite3.Connection) -> str | None:
    """Return what is wrong with an open database as a whole, see `damage`."""
    try:
        tables = {name for (name,) in db.execute("SELECT name FROM sqlite_master")}
        if not tables:
            (pages,) = db.execute("PRAGMA page_count").fetchone()
            return "it has no tables" if pages > 1 else None
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
    except database.ILL as error:
        return " ".join(str(error).split()) or type(error).__name__
    return None


def set_aside(path: Path) -> Path:
    """Give a database, with its log, a name that nothing else has; return it."""
    number = 1
    while (aside := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
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
    copied = 0
    for tables in _sound(damaged, _columns(db)):
        for table, rows in tables.items():
            database.insert(db, table, rows)
        copied += 1
    db.execute("UPDATE ledger SET trials = ?", (copied,))
    return copied


def _columns(db: sqlite3.Connection) -> list[str]:
    return [name for _, name, *_ in db.execute("PRAGMA table_info(episodes)")]


def _sound(path: Path, columns: list[str]) -> Iterator[dict[str, list[tuple[object, ...]]]]:
    """Yield the rows by table of every trial that can be read and has its checksum.

    None if episodes have other `columns`.
    """
    identities: dict[str, str] = {}
    with suppress(sqlite3.Error, *database.ILL), database.copied(path) as db:
        db.execute("PRAGMA writable_schema = ON")  # a table it cannot understand is passed over
        noted_by = db.execute("SELECT identity, sha256 FROM checksums")
        for identity, noted in noted_by if _columns(db) == columns else ():
            identities.setdefault(identity, noted)
    if not identities:
        return
    with database.copied(path) as db:
        db.execute("PRAGMA writable_schema = ON")
        for identity, noted in identities.items():
            tables: dict[str, list[tuple[object, ...]]] = {}
            try:
                if dict(trial_checksums(db, identity)) == {identity: noted}:
                    for table in ("trials", *OF_A_TRIAL):
                        query = f"SELECT * FROM {table} WHERE identity = ?"
                        tables[table] = db.execute(query, (identity,)).fetchall()
                    # The row that an index leads to may be another one.
                    tables["checksums"] = [(identity, noted)]
            except (sqlite3.Error, *database.ILL):
                continue
            if tables:
                yield tables
