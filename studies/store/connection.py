"""Connections to the database of a study, whose errors are one line.

It is written through, with a write-ahead log. That log needs memory that processes share, which
network file systems (NFS, Lustre, GPFS) do not give; there a rollback journal takes its place, and
who reads takes a copy first, so that no reader stops the one who writes. What a file system refuses
is never taken for damage.
"""

import errno
import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path

from ...core import locks
from ...core.shell import command_line
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
"""Errors that are no fault of the database; all others are: our statements fit our tables."""

NO_SHARED_MEMORY = (
    sqlite3.SQLITE_PROTOCOL,
    sqlite3.SQLITE_IOERR_SHMOPEN,
    sqlite3.SQLITE_IOERR_SHMSIZE,
    sqlite3.SQLITE_IOERR_SHMLOCK,
    sqlite3.SQLITE_IOERR_SHMMAP,
)
"""Errors of a write-ahead log on a file system that shares no memory, or has no locks for it."""

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
"""What a file system answers that has no locks."""

ILL = (UnicodeError, OverflowError)
"""What Python itself raises when SQLite hands it damaged text or sizes; no memory is no damage."""

BESIDE = ("-wal", "-journal", "-shm")
"""With what the names of the files end that SQLite keeps beside a database."""

PATIENCE = 60_000
"""How long to wait for those who copy a database with a rollback journal [ms]."""

NEARLY_FULL = 64_000_000
"""With fewer bytes left, an error of the disk is likely one of its size."""

COPY_WAITS_S = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
"""Wait before each attempt to copy a database [s]. An attempt fails if a writer interferes."""

LOG_HEADER_BYTES = 32
"""Size of the header of a write-ahead log. Its random salts change when the log starts again."""

JOURNAL_NONCE = slice(12, 16)
"""Position of the random number of a rollback journal, which differs between transactions."""

DATABASE_HEADER_BYTES = 100
"""Size of the header of a database. A commit without a log changes its change counter."""


class DamageError(SpecError):
    """A database holds something else than was written.

    Attributes
    ----------
    reason
        What is wrong with it.
    """

    def __init__(self, path: Path, reason: str, message: str = "") -> None:
        usual = f"{path}: is damaged: {reason}; {command_line('run')} repairs it"
        super().__init__(message or usual)
        self.reason = reason


class NoLocksError(SpecError):
    """A file system has no locks, so that two could write at once."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path}: this file system has no file locks; write on a local disk and copy the "
            "directory afterwards, or mount it with locks (NFS: without nolock; Lustre: flock)"
        )


@contextmanager
def open_to_write(path: Path) -> Iterator[sqlite3.Connection]:
    """Connect to write, and make the database if there is none; see `open_to_read`.

    Raises
    ------
    DamageError
        If the database is damaged.
    SpecError
        If it cannot be used, or the disk is full.
    """
    with _one_line(path):
        _begin_journal(path)
        with closing(_connect(path)) as connection:
            if not has_log(connection):
                connection.execute(f"PRAGMA busy_timeout = {PATIENCE}")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute("PRAGMA foreign_keys = ON")
            yield connection


def has_log(connection: sqlite3.Connection) -> bool:
    """Tell whether a database has a write-ahead log, and no rollback journal."""
    (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
    return bool(mode == "wal")


def _begin_journal(path: Path) -> None:
    """Give a database a write-ahead log; or a rollback journal, where that cannot be.

    A journal that is there stays: trying anew would take ten seconds each time.
    """
    try:
        with closing(_connect(path)) as connection:
            (pages,) = connection.execute("PRAGMA page_count").fetchone()
            if pages and not has_log(connection):
                return
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("ROLLBACK")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode not in NO_SHARED_MEMORY:
            raise
        # Who is alone needs no shared memory to end the log. The lock of the directory keeps
        # others from writing.
        with closing(_connect(path)) as connection:
            connection.execute("PRAGMA locking_mode = EXCLUSIVE")
            connection.execute("PRAGMA journal_mode = DELETE")
        path.with_name(f"{path.name}-shm").unlink(missing_ok=True)


@contextmanager
def open_to_read(path: Path) -> Iterator[sqlite3.Connection]:
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
    with _one_line(path), closing(_connect(uri)) as connection:
        try:
            connection.execute("BEGIN")
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
        except sqlite3.OperationalError:
            connection.close()
            with open_copy(path) as copy:
                yield copy
            return
        except ILL as error:
            raise DamageError(path, " ".join(str(error).split())) from None
        if not has_log(connection):
            # Whoever writes waits for those who read: so no longer than it takes to copy it.
            with closing(_connect("")) as copy:
                connection.backup(copy)
                connection.close()
                yield copy
            return
        connection.execute("PRAGMA query_only = ON")
        yield connection


@contextmanager
def open_copy(path: Path, waits: Iterable[float] = COPY_WAITS_S) -> Iterator[sqlite3.Connection]:
    """Connect to a copy of one committed state of a database, and leave the original as it is.

    SQLite cannot read a write-ahead log where it cannot create a file, as on a full disk. The copy
    takes no lock, so a writer may change the files meanwhile. The database is copied first and its
    log or journal after it: a log repeats and a journal reverts every change that the copy of the
    database may contain in part, unless it was started again in between. Such an attempt is
    discarded.

    Parameters
    ----------
    path
        The database.
    waits
        Wait before each attempt [s].

    Raises
    ------
    SpecError
        If a writer interfered with every attempt.
    """
    with tempfile.TemporaryDirectory() as folder:
        for wait in waits:
            time.sleep(wait)
            before = _generation(path)
            for suffix in ("", "-wal", "-journal"):
                name = path.name + suffix
                try:
                    shutil.copyfile(path.with_name(name), Path(folder) / name)
                except FileNotFoundError:
                    (Path(folder) / name).unlink(missing_ok=True)  # of an earlier attempt
            if _generation(path) == before:
                break
        else:
            raise SpecError(
                f"{path}: another process writes to it without a pause, and it can only be copied "
                "here; try again later"
            )
        with closing(_connect(Path(folder) / path.name)) as connection:
            yield connection


def _generation(path: Path) -> tuple[object, ...]:
    """Return a value that is equal before and after a copy of the files of a database is made.

    If it differs, the copied files may not belong together, see `open_copy`.
    """
    header = _read_start(path, DATABASE_HEADER_BYTES)
    log = _read_start(path.with_name(f"{path.name}-wal"), LOG_HEADER_BYTES)
    if log:
        return (log,)
    journal = _read_start(path.with_name(f"{path.name}-journal"), JOURNAL_NONCE.stop)
    if journal:
        return (journal[JOURNAL_NONCE],)
    # Read twice: a transaction may end between the look for its journal and either reading.
    status = path.stat()
    again = _read_start(path, DATABASE_HEADER_BYTES)
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
    """Keep all that is written in the context, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    with connection:  # which commits, or rolls back what SQLite has not when the disk is full
        yield


def _connect(database: Path | str) -> sqlite3.Connection:
    """Connect to a file, to what a URI names, or by an empty text to a new database nowhere."""
    is_uri = isinstance(database, str)
    connection = sqlite3.connect(database, uri=is_uri, isolation_level=None)
    # A flipped bit may make text that is no UTF-8; checksums tell, decoding need not.
    connection.text_factory = partial(str, encoding="utf-8", errors="replace")
    return connection


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
    """Raise errors of a database as one line; it and the files beside it must be files."""
    for suffix in ("", *BESIDE):
        beside = path.with_name(path.name + suffix)
        if os.path.lexists(beside) and not beside.is_file():
            raise SpecError(f"{beside}: is no file, and in the way of one; remove it")
    try:
        yield
    except sqlite3.DatabaseError as error:
        raise _explain(path, error) from None


def check_circumstance(path: Path, code: int) -> None:
    """Raise what a code of SQLite stands for, if it is no fault of the database."""
    if code == sqlite3.SQLITE_NOMEM:
        raise MemoryError
    if code & 0xFF in CIRCUMSTANCES and code != sqlite3.SQLITE_IOERR_SHORT_READ:
        raise SpecError(f"{path}: cannot be read: error {code} of SQLite")


def _explain(path: Path, error: sqlite3.DatabaseError) -> SpecError:
    """Return what is said of an error of a database."""
    # One that the module of Python raises has no code.
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
    if code not in CIRCUMSTANCES:
        return DamageError(path, str(error))
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_IOERR) and not has_locks(path):
        return NoLocksError(path)
    if code != sqlite3.SQLITE_IOERR:
        return SpecError(f"{path}: {error}")
    # SQLite says no more when the disk is full at some places.
    free = shutil.disk_usage(path.parent).free
    room = f", {free // 1000} kB free on this disk" if free < NEARLY_FULL else ""
    return SpecError(f"{path}: {error} ({error.sqlite_errorname}){room}")


def has_locks(path: Path) -> bool:
    """Tell whether the file system of a file has locks, by a new file beside it."""
    probe = path.with_name(f"{path.name}-lock")
    try:
        with open(probe, "w") as file:
            locks.lock_record(file)
    except OSError as error:
        return error.errno not in NO_LOCKS
    finally:
        with suppress(OSError):
            probe.unlink()
    return True
