"""Integrity check of a study's database as a whole.

SQLite notices a torn page but not a flipped digit. Each trial therefore has a checksum of its rows,
see `checksums`, and the description of the study has another one. Only trials that are planned may
have rows.
"""

import re
import sqlite3
from pathlib import Path

from ..errors import SpecError
from . import database
from .checksums import study_checksum
from .connection import CIRCUMSTANCES, DECODE_ERRORS, damaged
from .database import TABLES_OF_TRIALS, NoStudyError

ERROR_CODE = re.compile(r"error code=(\d+)")
"""Finds the error that kept SQLite from looking for damage."""


def check_study(path: Path, db: sqlite3.Connection) -> int:
    """Check an open database as a whole and return its results version.

    Checksums of other versions are not verified. The rows of trials are checked by `Store.verify`.

    Raises
    ------
    NoStudyError
        If the database is empty.
    SpecError
        If it is damaged, or it has been written by a newer version, or does not belong to a study.
    """
    try:
        _check_file(path, db)
        meta = dict(db.execute("SELECT key, value FROM meta").fetchall())
        version = str(meta.get("results_version"))
        if version.isdecimal() and int(version) > database.RESULTS_VERSION:
            raise SpecError(
                f"{path}: holds results of version {version}, this is version "
                f"{database.RESULTS_VERSION}; a newer nested-agents reads it"
            )
        if version.isdecimal() and int(version) < database.RESULTS_VERSION:
            return int(version)
        if meta.get("sha256") != study_checksum(db):
            raise damaged(
                path,
                "the description of the study does not match its checksum; a study of an earlier "
                "development version of nested-agents looks the same",
            )
        _check_planned(path, db)
        return int(version)
    except DECODE_ERRORS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise damaged(path, reason) from None


def _check_file(path: Path, db: sqlite3.Connection) -> None:
    """Raise an error unless the file is an undamaged database of a study.

    Raises
    ------
    NoStudyError
        If the database is empty.
    SpecError
        If SQLite finds damage or cannot read the database, or it is not of a study.
    MemoryError
        If SQLite runs out of memory.
    """
    tables = {name for (name,) in db.execute("SELECT name FROM sqlite_master")}
    if not tables:
        (pages,) = db.execute("PRAGMA page_count").fetchone()
        if pages > 1:
            raise damaged(path, "it has no tables")
        raise NoStudyError(f"{path}: is empty, it holds no study yet")
    if not tables & {"meta", *TABLES_OF_TRIALS}:
        raise SpecError(f"{path}: is a database, but no study; use another directory")
    (answer,) = db.execute("PRAGMA integrity_check(1)").fetchone()
    if answer == "ok":
        return
    if failure := ERROR_CODE.search(str(answer)):
        code = int(failure[1])
        if code == sqlite3.SQLITE_NOMEM:
            raise MemoryError
        if code & 0xFF in CIRCUMSTANCES and code != sqlite3.SQLITE_IOERR_SHORT_READ:
            raise SpecError(f"{path}: cannot be read: SQLite error {code}")
    raise damaged(path, " ".join(str(answer).replace("*** in database main ***", "").split()))


def _check_planned(path: Path, db: sqlite3.Connection) -> None:
    """Raise if a trial has rows that is not planned."""
    present = " UNION ".join(f"SELECT identity FROM {table}" for table in TABLES_OF_TRIALS)
    row = db.execute(f"{present} EXCEPT SELECT identity FROM planned LIMIT 1").fetchone()
    if row is not None:
        query = "SELECT condition, seed FROM trials WHERE identity IS ?"
        trial = db.execute(query, row).fetchone()
        name = f"trial {row[0]}" if trial is None else f"{trial[0]}, seed {trial[1]}"
        raise damaged(path, f"it holds rows of a trial that is not of this study: {name}")
