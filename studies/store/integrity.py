"""What is wrong with a database, and what is done about it.

The checksums are the ledger of the trials that were run, and `planned` lists those of the study.
Rows of a trial that either of them lacks are damage: no run wrote them. A damaged database is set
aside under another name, and what can be trusted of it taken over.
"""

import os
import re
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import suppress
from itertools import count, takewhile
from pathlib import Path

from ..errors import SpecError
from . import database
from .checksums import study_checksum, trial_checksums
from .connection import BESIDE, ILL, check_circumstance, open_copy, open_to_read
from .database import OF_A_TRIAL, NoStudyError, insert, quote


def is_orphaned(path: Path) -> bool:
    """Tell whether only the log is left of a database: SQLite would drop it without a word."""
    log = path.with_name(f"{path.name}-wal")
    return _size(log) > 0 and _size(path) == 0


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def find_fault(path: Path, db: sqlite3.Connection) -> str | None:
    """Return what is wrong with an open database as a whole; None if nothing is.

    Raises
    ------
    NoStudyError
        If it is empty.
    SpecError
        If it is of another version, or is no study's.
    """
    try:
        return _fault_of_file(path, db) or _fault_of_study(path, db) or _fault_of_trials(db)
    except ILL as error:
        return " ".join(str(error).split()) or type(error).__name__


def _fault_of_file(path: Path, db: sqlite3.Connection) -> str | None:
    """Return what SQLite has to say."""
    tables = {name for (name,) in db.execute("SELECT name FROM sqlite_master")}
    if not tables:
        (pages,) = db.execute("PRAGMA page_count").fetchone()
        if pages > 1:
            return "it has no tables"
        raise NoStudyError(f"{path}: is empty, it holds no study yet")
    if not tables & {"meta", "trials", *OF_A_TRIAL}:
        raise SpecError(f"{path}: is a database, but no study; use another directory")
    (answer,) = db.execute("PRAGMA integrity_check(1)").fetchone()
    if answer == "ok":
        return None
    if code := _CODE.search(str(answer)):
        check_circumstance(path, int(code[1]))
    return " ".join(str(answer).replace("*** in database main ***", "").split())


_CODE = re.compile(r"error code=(\d+)")
"""Finds what SQLite could not do while it looked for damage."""


def _fault_of_study(path: Path, db: sqlite3.Connection) -> str | None:
    """Return whether it says of the study what was written; versions come first."""
    meta = dict(db.execute("SELECT key, value FROM meta").fetchall())
    written = str(meta.get("results_version"))
    here = database.RESULTS_VERSION
    # Checksums of another version may be others.
    if written.isdecimal() and int(written) != here:
        is_newer = int(written) > here
        raise SpecError(
            f"{path}: holds results of version {written}, this is version {here}; "
            f"{'a newer' if is_newer else 'an older'} nested-agents reads it"
        )
    if meta.get("sha256") != study_checksum(db):
        return "what it says of the study is not what was written"
    return None


def _fault_of_trials(db: sqlite3.Connection) -> str | None:
    """Return whether its trials are those that were run; for their rows see `Store.verify`."""
    kept = db.execute("SELECT count(*) FROM checksums").fetchall()
    if db.execute("SELECT trials FROM ledger").fetchall() != kept:
        return "it does not hold as many trials as were run"
    if unwritten := _select(db, _NOT_IN_LEDGER):
        return f"it holds rows that no run wrote: {_name(db, unwritten)}"
    if unplanned := _select(db, _NOT_PLANNED):
        return f"it holds trials that are not of this study: {_name(db, unplanned)}"
    return None


_NOT_IN_LEDGER = " UNION ".join(
    f"SELECT * FROM (SELECT DISTINCT identity FROM {table} EXCEPT SELECT identity FROM checksums)"
    for table in ("trials", "episodes", "seconds", "numbers")
)
"""Selects the identities of rows that have no checksum; NULL is one."""
_NOT_PLANNED = "SELECT identity FROM checksums EXCEPT SELECT identity FROM planned"
"""Selects the identities of trials that are not of the study."""


def _select(db: sqlite3.Connection, query: str) -> list[object]:
    return [row[0] for row in db.execute(query)]


def _name(db: sqlite3.Connection, identities: Collection[object]) -> str:
    """Return the first of some trials by condition and seed, and how many more there are."""
    first = next(iter(identities))
    query = "SELECT condition, seed FROM trials WHERE identity = ?"
    row = db.execute(query, (first,)).fetchone()
    name = f"trial {first}" if row is None else f"{row[0]}, seed {row[1]}"
    more = len(identities) - 1
    return f"{name} (and of {more} more)" if more else name


def find_superseded(path: Path, planned: Collection[str]) -> str | None:
    """Return which trials of a sound database a new plan has no more; None if it has all."""
    if not path.exists():
        return None
    with open_to_read(path) as db:
        if not _select(db, "SELECT 1 FROM sqlite_master WHERE name = 'checksums'"):
            return None
        identities = _select(db, "SELECT identity FROM checksums")
        others = [identity for identity in identities if identity not in planned]
        if not others:
            return None
        return f"holds trials that are not of this study any more: {_name(db, others)}"


def set_aside(path: Path) -> Path:
    """Give a database, with its log, a name that nothing else has; return it."""
    aside = next(name for name in _asides(path) if not name.exists())
    # The database last: if this is interrupted, it is found damaged once more.
    for suffix in (*BESIDE, ""):
        old = path.with_name(path.name + suffix)
        if suffix == "-shm":
            old.unlink(missing_ok=True)
        elif old.exists():
            os.replace(old, aside.with_name(aside.name + suffix))
    return aside


def last_aside(path: Path) -> Path | None:
    """Return the database that was set aside last, if any.

    It is what a new one begins with if whoever set it aside was stopped before all was taken over.
    """
    asides = [*takewhile(Path.exists, _asides(path))]
    return asides[-1] if asides else None


def _asides(path: Path) -> Iterator[Path]:
    """Yield the names of databases that are set aside, in their order."""
    return (path.with_name(f"{path.name}.damaged-{number}") for number in count(1))


def recover(damaged: Path, db: sqlite3.Connection) -> int:
    """Copy the trials whose rows are what was written; within a transaction.

    Parameters
    ----------
    damaged
        A database that was set aside.
    db
        The new one, which has tables and what is planned, but no trials.

    Returns
    -------
    int
        How many trials were copied; none if episodes have other measures now.
    """
    planned = {*_select(db, "SELECT identity FROM planned")}
    queries = {}
    for table in ("trials", *OF_A_TRIAL):
        names = ", ".join(map(quote, _columns(db, table)))  # the damaged one may have more
        queries[table] = f"SELECT {names} FROM {table} WHERE identity = ?"
    copied = 0
    with open_copy(damaged) as old:
        for identity, checksum in _read_checksums(old, _columns(db, "episodes")).items():
            if identity not in planned:
                continue
            try:
                if dict(trial_checksums(old, identity)) != {identity: checksum}:
                    continue
                tables = {
                    table: old.execute(query, (identity,)).fetchall()
                    for table, query in queries.items()
                }
            except (sqlite3.Error, *ILL):
                continue
            # The row that an index leads to may be another one.
            tables["checksums"] = [(identity, checksum)]
            for table, rows in tables.items():
                insert(db, table, rows)
            copied += 1
    db.execute("UPDATE ledger SET trials = ?", (copied,))
    return copied


def _read_checksums(old: sqlite3.Connection, columns: list[str]) -> dict[str, str]:
    """Return what a damaged database has of checksums; none if episodes have other columns."""
    checksums: dict[str, str] = {}
    with suppress(sqlite3.Error, *ILL):
        # A table that it cannot understand is passed over.
        old.execute("PRAGMA writable_schema = ON")
        if _columns(old, "episodes") != columns:
            return {}
        for identity, checksum in old.execute("SELECT identity, sha256 FROM checksums"):
            checksums.setdefault(identity, checksum)
    return checksums


def _columns(db: sqlite3.Connection, table: str) -> list[str]:
    return [name for _, name, *_ in db.execute(f"PRAGMA table_info({table})")]
