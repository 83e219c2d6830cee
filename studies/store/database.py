"""Connections to the database of a study: written through, and errors in one line."""

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

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


class DamageError(SpecError):
    """A database holds something else than was written.

    Attributes
    ----------
    reason
        What is wrong with it.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: is damaged: {reason}; nested-agents run mends it")
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
    _check_beside(path)
    with _one_line(path), _closing(sqlite3.connect(path, isolation_level=None)) as connection:
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
    _check_beside(path)
    with _one_line(path):
        # Not mode=ro: such a connection leaves SQLite's -wal and -shm files behind.
        uri = f"{path.absolute().as_uri()}?mode=rw"
        with _closing(sqlite3.connect(uri, uri=True, isolation_level=None)) as connection:
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
        with _closing(sqlite3.connect(Path(folder) / path.name)) as connection:
            yield connection


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Keep all that is written in the context, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:  # SQLite itself ends it when the disk is full
            connection.execute("ROLLBACK")
        raise


def insert(connection: sqlite3.Connection, table: str, rows: list[tuple[object, ...]]) -> None:
    """Insert whole rows into a table."""
    if rows:
        places = ", ".join("?" * len(rows[0]))
        connection.executemany(f"INSERT INTO {table} VALUES ({places})", rows)


def quoted(name: str) -> str:
    """Return a name as SQL takes any name."""
    return '"' + name.replace('"', '""') + '"'


@contextmanager
def _closing(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    # A flipped bit may make text that is no UTF-8; checksums tell, decoding need not.
    connection.text_factory = partial(str, encoding="utf-8", errors="replace")
    try:
        yield connection
    finally:
        connection.close()


def _check_beside(path: Path) -> None:
    """Refuse what stands in the place of a file that SQLite keeps beside the database."""
    for suffix in ("", "-wal", "-shm"):
        beside = path.with_name(path.name + suffix)
        if os.path.lexists(beside) and not beside.is_file():
            raise SpecError(f"{beside}: is no file, and in the way of one; remove it")


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
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
