"""Connections to the database of a study, with errors of one line.

The database has a rollback journal, which also works on network file systems. A reader copies the
database first, so a writer waits no longer than a copy takes.
"""

import errno
import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

from ..errors import SpecError

CIRCUMSTANCES = (
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_NOMEM,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_PROTOCOL,
    sqlite3.SQLITE_NOLFS,
)
"""Error codes of a file system or a machine. All other errors are damage of the database."""

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
"""Errors of a file system without file locks."""

DECODE_ERRORS = (UnicodeError, OverflowError)
"""Errors of Python when SQLite returns damaged text or sizes."""

SIDE_FILES = ("-journal", "-wal")
"""Suffixes of the files that SQLite keeps next to a database; older versions kept a log (-wal)."""

READ_TIMEOUT_S = 1.0
"""Maximum time that a reader waits for a transaction to end before it copies the files [s]."""

WRITE_TIMEOUT_S = 60.0
"""Maximum time that a writer waits for readers to end their copies [s]."""

NEARLY_FULL_BYTES = 64_000_000
"""Free space below which an error message names it [bytes]."""

COPY_WAITS_S = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
"""Wait before each attempt to copy the files of a database [s]."""

JOURNAL_NONCE = slice(12, 16)
"""Position of the random number of a rollback journal, which differs between transactions."""

HEADER_BYTES = 100
"""Size of the header of a database. Every commit changes a counter in it."""


def damaged(path: Path, reason: str) -> SpecError:
    """Return the error of a database that does not hold what was written."""
    return SpecError(
        f"{path}: is damaged: {reason}; nothing in this directory has been changed: restore the "
        "file from a copy, or run the study in another directory"
    )


@contextmanager
def open_to_write(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to a database to write, and create it if necessary.

    Raises
    ------
    SpecError
        If the database is damaged, or it cannot be used, or the disk is full.
    """
    with _one_line_errors(path), closing(_connect(path, WRITE_TIMEOUT_S)) as connection:
        connection.execute("PRAGMA synchronous = EXTRA")
        connection.execute("PRAGMA foreign_keys = ON")
        yield connection


@contextmanager
def open_to_read(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to a copy of one committed state of an existing database.

    Where the database cannot be opened, its files are copied: there may be no locks, or SQLite may
    not be allowed to write. The database is copied first and its journal after it, because a
    journal reverts every change that the copy may contain in part, unless another transaction began
    in between. Such an attempt is discarded.

    Raises
    ------
    SpecError
        If the database is damaged, or it cannot be read, or a writer interfered with every attempt.
    """
    with _one_line_errors(path), tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        try:
            with (
                closing(_connect(f"{path.absolute().as_uri()}?mode=rw", READ_TIMEOUT_S)) as source,
                closing(_connect(copy)) as target,
            ):
                source.execute("BEGIN")
                source.execute("SELECT 1 FROM sqlite_master").fetchone()  # waits for the lock
                target.execute("PRAGMA synchronous = OFF")
                source.backup(target)
        except sqlite3.OperationalError:
            _copy_files(path, copy)
        with closing(_connect(copy)) as connection:
            yield connection


def _copy_files(path: Path, copy: Path) -> None:
    """Copy the files of a database, see `open_to_read`."""
    for wait in COPY_WAITS_S:
        time.sleep(wait)
        before = _generation(path)
        for suffix in ("", *SIDE_FILES):
            target = copy.with_name(copy.name + suffix)
            try:
                shutil.copyfile(path.with_name(path.name + suffix), target)
            except FileNotFoundError:
                target.unlink(missing_ok=True)  # from an earlier attempt
        if _generation(path) == before:
            return
    raise SpecError(
        f"{path}: another process writes to it without a pause, and it can only be copied here; "
        "try again later"
    )


def _generation(path: Path) -> tuple[object, ...]:
    """Return a value that differs before and after a copy if the copied files do not match."""
    header = _read_start(path, HEADER_BYTES)
    journal = _read_start(path.with_name(f"{path.name}-journal"), JOURNAL_NONCE.stop)
    if journal:
        return (journal[JOURNAL_NONCE],)
    # Read twice: a transaction may end between the look for its journal and either reading.
    status = path.stat()
    again = _read_start(path, HEADER_BYTES)
    return header, again, status.st_size, status.st_mtime_ns


def _read_start(path: Path, size: int) -> bytes:
    """Return the first bytes of a file. A missing file has none."""
    try:
        with path.open("rb", buffering=0) as file:
            return file.read(size)
    except FileNotFoundError:
        return b""


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit everything that is written in the context, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    with connection:  # also rolls back what SQLite does not when the disk is full
        yield


def _connect(database: Path | str, timeout: float = READ_TIMEOUT_S) -> sqlite3.Connection:
    """Connect to a file, or to the file that a URI names."""
    is_uri = isinstance(database, str)
    connection = sqlite3.connect(database, uri=is_uri, isolation_level=None, timeout=timeout)
    # A flipped bit may make invalid UTF-8; checksums report it, decoding need not.
    connection.text_factory = partial(str, encoding="utf-8", errors="replace")
    return connection


@contextmanager
def _one_line_errors(path: Path) -> Iterator[None]:
    """Raise errors of a database in one line. The database and its side files must be files."""
    for suffix in ("", *SIDE_FILES):
        file = path.with_name(path.name + suffix)
        if os.path.lexists(file) and not file.is_file():
            raise SpecError(f"{file}: must be a file; remove it")
    try:
        yield
    except sqlite3.DatabaseError as error:
        raise _explain(path, error) from None
    except UnicodeDecodeError as error:  # of SQLite's message, which quotes the damaged text
        raise damaged(path, str(error)) from None


def _explain(path: Path, error: sqlite3.DatabaseError) -> SpecError:
    """Return the one-line error for an error of a database."""
    # An error that Python's module raises itself has no code.
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
    if code not in CIRCUMSTANCES:
        return damaged(path, str(error))
    if code != sqlite3.SQLITE_IOERR:
        return SpecError(f"{path}: {error}")
    # SQLite reports some cases of a full disk as an input/output error.
    free = shutil.disk_usage(path.parent).free
    room = f", {free // 1000} kB free on this disk" if free < NEARLY_FULL_BYTES else ""
    return SpecError(f"{path}: {error} ({error.sqlite_errorname}){room}")
