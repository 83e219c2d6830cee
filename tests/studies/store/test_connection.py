"""Databases in folders of other machines: errors of a file system are not damage."""

import errno
import os
import shutil
import sqlite3
import tempfile
from contextlib import contextmanager
from functools import partial
from itertools import count, repeat
from pathlib import Path

import made_up
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from nested_agents.studies.errors import SpecError
from nested_agents.studies.store import connection, writer
from nested_agents.studies.store.connection import open_to_read, open_to_write
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import Store
from nested_agents.studies.workers.runner import save


def rows(directory):
    with Store.open(directory) as store:
        store.verify()
        return list(store.episodes()[1])


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    directory = tmp_path_factory.mktemp("here") / "study"
    with made_up.opened(directory) as store:
        for trial in made_up.TRIALS:
            save(store, trial, made_up.measure(trial), 1.5)
    return directory


@pytest.mark.parametrize("code", ["SQLITE_BUSY", "SQLITE_IOERR_LOCK", "SQLITE_CANTOPEN"])
def test_a_study_is_read_where_sqlite_cannot_open_it(code, expected, monkeypatch):
    before = rows(expected)
    connect = connection._connect

    def refuse_original(database, *timeout):
        if isinstance(database, str):
            raise_(getattr(sqlite3, code), code)
        return connect(database, *timeout)

    monkeypatch.setattr(connection, "_connect", refuse_original)
    assert rows(expected) == before


@pytest.mark.parametrize("error", [errno.ENOLCK, errno.ENOSYS])
def test_a_directory_that_cannot_be_locked_is_told(error, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(error, "No locks available")

    monkeypatch.setattr(writer.locks, "lock", refuse)
    with pytest.raises(SpecError, match="has no file locks"), made_up.opened(tmp_path / "study"):
        pass


def raise_(code, name):
    error = sqlite3.OperationalError("disk I/O error")
    error.sqlite_errorcode = code
    error.sqlite_errorname = name
    raise error


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (sqlite3.SQLITE_PROTOCOL, "SQLITE_PROTOCOL"),
        (sqlite3.SQLITE_BUSY, "SQLITE_BUSY"),
        (sqlite3.SQLITE_BUSY_RECOVERY, "SQLITE_BUSY_RECOVERY"),
        (sqlite3.SQLITE_NOLFS, "SQLITE_NOLFS"),
        (sqlite3.SQLITE_CANTOPEN, "SQLITE_CANTOPEN"),
        (sqlite3.SQLITE_IOERR_SHMMAP, "SQLITE_IOERR_SHMMAP"),
        (sqlite3.SQLITE_IOERR_LOCK, "SQLITE_IOERR_LOCK"),
        (sqlite3.SQLITE_IOERR_READ, "SQLITE_IOERR_READ"),
    ],
)
def test_what_a_file_system_refuses_is_no_damage(code, name, expected):
    refused = pytest.raises(SpecError)
    with refused as caught, open_to_read(expected / DATABASE):
        raise_(code, name)
    assert "is damaged" not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("free", "is_told"), [(100_000, True), (54_000_000_000, False)])
def test_free_space_is_told_of_a_disk_that_is_nearly_full(free, is_told, expected, monkeypatch):
    usage = shutil._ntuple_diskusage(10**12, 10**12 - free, free)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    refused = pytest.raises(SpecError, match=r"disk I/O error \(SQLITE_IOERR_WRITE\)")
    with refused as caught, open_to_read(expected / DATABASE):
        raise_(sqlite3.SQLITE_IOERR_WRITE, "SQLITE_IOERR_WRITE")
    assert ("free on this disk" in str(caught.value)) == is_told


def test_readers_do_not_hold_up_the_writer(tmp_path):
    path = tmp_path / DATABASE
    with open_to_write(path) as db:
        db.execute("CREATE TABLE numbers (n)")
        with open_to_read(path) as reader:
            db.execute("PRAGMA busy_timeout = 0")
            db.execute("INSERT INTO numbers VALUES (1)")
            assert reader.execute("SELECT count(*) FROM numbers").fetchone() == (0,)
    with open_to_read(path) as reader:
        assert reader.execute("SELECT count(*) FROM numbers").fetchone() == (1,)


def test_the_journal_of_a_killed_writer_is_rolled_back_in_the_copy(tmp_path):
    writer = Writer(tmp_path / DATABASE)
    writer.begin()
    killed = tmp_path / "killed"
    killed.mkdir()
    for path in tmp_path.glob(f"{DATABASE}*"):
        shutil.copy(path, killed)
    assert (killed / f"{DATABASE}-journal").stat().st_size > 0
    with open_to_read(killed / DATABASE) as reader:
        assert read(reader) == writer.states[-1]
    writer.db.close()


class Writer:
    """A process that writes to a database, played step by step while a copy of it is made.

    Each transaction moves one unit between two far pages of the database, always two others, and
    adds one to a count.
    """

    PAGES = 40

    def __init__(self, path):
        self.path = path
        self.states = []
        self.numbers = count()
        self.open()
        self.db.execute("CREATE TABLE accounts (n INTEGER, text)")
        self.db.execute("CREATE TABLE log (n INTEGER, text)")
        rows = [(10, "x" * 3000)] * self.PAGES
        self.db.executemany("INSERT INTO accounts VALUES (?, ?)", rows)
        self.states.append(read(self.db))

    def open(self):
        self.db = sqlite3.connect(self.path, isolation_level=None)
        self.db.execute("PRAGMA synchronous = OFF")

    def begin(self):
        """Write a part of a transaction to the files, as a full cache makes SQLite do."""
        if not self.db.in_transaction:
            self.db.execute("PRAGMA cache_size = 1")
            self.db.execute("BEGIN IMMEDIATE")
            k = next(self.numbers) % 7
            self.db.execute("UPDATE accounts SET n = n + 1 WHERE rowid = ?", (1 + k,))
            self.db.execute("UPDATE accounts SET n = n - 1 WHERE rowid = ?", (self.PAGES - k,))
            self.db.execute("INSERT INTO log VALUES (1, ?)", ("y" * 9000,))
            self.db.execute("SELECT count(text) FROM accounts").fetchall()

    def commit(self):
        self.begin()
        self.db.execute("COMMIT")
        self.states.append(read(self.db))

    def commit_and_begin(self):
        self.commit()
        self.begin()

    def roll_back(self):
        self.begin()
        self.db.execute("ROLLBACK")


def read(db):
    assert db.execute("PRAGMA integrity_check(1)").fetchone() == ("ok",)
    accounts = [n for (n,) in db.execute("SELECT n FROM accounts ORDER BY rowid")]
    return accounts, db.execute("SELECT count(*) FROM log").fetchone()


STEPS = (Writer.begin, Writer.commit, Writer.commit_and_begin, Writer.roll_back)
"""Steps that a writer may take while a part of its files is copied."""
NEXT_JOURNAL = (Writer.commit, Writer.commit_and_begin)
LATE_COMMIT = (*[Writer.begin] * 3, Writer.commit)


@contextmanager
def interrupted_copies(steps):
    """Copy files in three parts, and take one of the steps before each part while there are any."""
    left = iter(steps)

    def copy(source, target):
        with open(source, "rb") as old, open(target, "wb") as new:
            size = os.stat(source).st_size // 3 // 4096 * 4096 + 4096
            part = bytes(size)
            while len(part) == size:
                next(left, lambda: None)()
                part = old.read(size)
                new.write(part)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(connection.shutil, "copyfile", copy)
        yield


@contextmanager
def copied(path, attempts):
    """Connect to a copy of the files of a database, made within a number of attempts."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(connection, "COPY_WAITS_S", [0.0] * attempts)
            connection._copy_files(path, copy)
        db = sqlite3.connect(copy)
        yield db
        db.close()


@example(before=[Writer.begin], during=NEXT_JOURNAL)
@example(before=[], during=LATE_COMMIT)
@given(before=st.lists(st.sampled_from(STEPS), max_size=3), during=st.lists(st.sampled_from(STEPS)))
def test_a_copy_holds_a_state_that_was_written_whatever_happens_meanwhile(before, during):
    with tempfile.TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / DATABASE)
        for step in before:
            step(writer)
        first = len(writer.states) - 1
        steps = (partial(step, writer) for step in during)
        with interrupted_copies(steps), copied(writer.path, attempts=20) as copy:
            assert read(copy) in writer.states[first:]
        writer.db.close()


def test_a_database_that_is_written_without_a_pause_is_refused(tmp_path):
    writer = Writer(tmp_path / DATABASE)
    refused = pytest.raises(SpecError, match=f"{DATABASE}: another process writes")
    with refused, interrupted_copies(repeat(writer.commit)), copied(writer.path, attempts=2):
        pass
    writer.db.close()
