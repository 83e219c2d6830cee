"""A study in a folder of another machine: what its file system refuses is never damage."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
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
from nested_agents.studies.store.connection import has_log, open_copy, open_to_read, open_to_write
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import NO_LOG, Store
from nested_agents.studies.workers.runner import save

NEEDS_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")

DRIVER = """
import io
import json
import os
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import made_up
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import save


def write(directory, count):
    try:
        with made_up.opened(directory) as store:
            for trial in pending(store, made_up.TRIALS)[:count]:
                save(store, trial, made_up.measure(trial), 1.5)
            print(*store.notes, sep="\\n")
    except SpecError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


for line in sys.stdin:
    os.environ["FOLDER"], directory, count = json.loads(line)
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        if count:
            status = write(Path(directory), count)
        else:
            status = main(["results", directory, "--format", "csv"])
    print(json.dumps([status, out.getvalue(), err.getvalue()]), flush=True)
"""
"""Writes a number of trials, or reads a study if that is zero, in a folder of some kind."""


@pytest.fixture(scope="module")
def act(tmp_path_factory):
    """Act on a study in a folder of some kind; return exit status, output and errors."""
    library = tmp_path_factory.mktemp("shim") / "no_locks.so"
    source = Path(__file__).with_name("no_locks.c")
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    paths = [str(Path(made_up.__file__).parent), os.environ.get("PYTHONPATH", "")]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "LD_PRELOAD": str(library),
    }
    with subprocess.Popen(
        [sys.executable, "-c", DRIVER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    ) as driver:

        def run(folder, directory, count=0):
            print(json.dumps([folder, str(directory), count]), file=driver.stdin, flush=True)
            return json.loads(driver.stdout.readline())

        yield run


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


@NEEDS_GCC
@pytest.mark.parametrize(
    ("folder", "begun"),
    [
        ("memory", "there"),
        ("memory", "elsewhere"),
        ("shared", "there"),
        ("shared", "elsewhere"),
        ("busy", "there"),
    ],
)
def test_without_shared_memory_a_rollback_journal_keeps_the_same(
    folder, begun, act, expected, tmp_path
):
    directory = tmp_path / "no_locks" / "study"
    if begun == "elsewhere":
        with made_up.opened(directory) as store:
            save(store, made_up.TRIALS[0], made_up.measure(made_up.TRIALS[0]), 1.5)
    status, out, err = act(folder, directory, 3)
    assert (status, err) == (0, "")
    assert out == f"{directory / DATABASE}: {NO_LOG}\n"
    assert act(folder, directory, 6)[0] == 0
    status, out, err = act(folder, directory)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 1 + 6 * 4  # of training
    assert rows(directory) == rows(expected)
    assert not list(directory.glob("*.damaged-*"))


@NEEDS_GCC
def test_without_locks_one_line_says_what_to_do_and_what_is_there_is_read(act, expected, tmp_path):
    directory = tmp_path / "no_locks" / "study"
    status, out, err = act("locks", directory, 1)
    assert (status, out) == (2, "")
    assert "this file system has no file locks; write on a local disk" in err
    assert err.count("\n") == 1
    shutil.rmtree(directory)
    shutil.copytree(expected, directory)
    before = (directory / DATABASE).read_bytes()
    status, out, err = act("locks", directory)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 1 + 6 * 4  # of training
    assert act("locks", directory, 1)[0] == 2
    assert (directory / DATABASE).read_bytes() == before
    assert not list(directory.glob("*.damaged-*"))


def test_a_directory_that_cannot_be_locked_is_told(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(37, "No locks available")

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
    assert not isinstance(caught.value, connection.DamageError)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("free", "is_told"), [(100_000, True), (54_000_000_000, False)])
def test_free_space_is_told_of_a_disk_that_is_nearly_full(free, is_told, expected, monkeypatch):
    usage = shutil._ntuple_diskusage(10**12, 10**12 - free, free)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    refused = pytest.raises(SpecError, match=r"disk I/O error \(SQLITE_IOERR_WRITE\)")
    with refused as caught, open_to_read(expected / DATABASE):
        raise_(sqlite3.SQLITE_IOERR_WRITE, "SQLITE_IOERR_WRITE")
    assert ("free on this disk" in str(caught.value)) == is_told


def test_a_rollback_journal_stays_and_readers_do_not_hold_up_the_writer(tmp_path):
    path = tmp_path / DATABASE
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE numbers (n)")
    db.close()
    with open_to_write(path) as db:
        assert not has_log(db)
        with open_to_read(path) as reader:
            db.execute("PRAGMA busy_timeout = 100")
            db.execute("INSERT INTO numbers VALUES (1)")
            assert reader.execute("SELECT count(*) FROM numbers").fetchone() == (0,)
    with open_to_read(path) as reader:
        assert reader.execute("SELECT count(*) FROM numbers").fetchone() == (1,)


class Writer:
    """A process that writes to a database, played step by step while a copy of it is made.

    Each transaction moves one unit between two far pages of the database, always two others, and
    adds one to a count.
    """

    PAGES = 40

    def __init__(self, path, journal):
        self.path = path
        self.states = []
        self.numbers = count()
        self.open()
        self.db.execute(f"PRAGMA journal_mode = {journal}")
        self.db.execute("CREATE TABLE accounts (n INTEGER, text)")
        self.db.execute("CREATE TABLE log (n INTEGER, text)")
        rows = [(10, "x" * 3000)] * self.PAGES
        self.db.executemany("INSERT INTO accounts VALUES (?, ?)", rows)
        self.states.append(read(self.db))

    def open(self):
        self.db = sqlite3.connect(self.path, isolation_level=None)
        self.db.execute("PRAGMA wal_autocheckpoint = 0")
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

    def checkpoint(self):
        """Move pages from the log into the database; the next commit starts the log again."""
        if not self.db.in_transaction:
            self.db.execute("PRAGMA wal_checkpoint(RESTART)")

    def come_again(self):
        """End, which deletes the log, and start again."""
        self.db.close()
        self.open()


def read(db):
    assert db.execute("PRAGMA integrity_check(1)").fetchone() == ("ok",)
    accounts = [n for (n,) in db.execute("SELECT n FROM accounts ORDER BY rowid")]
    return accounts, db.execute("SELECT count(*) FROM log").fetchone()


STEPS = (
    Writer.begin,
    Writer.commit,
    Writer.commit_and_begin,
    Writer.roll_back,
    Writer.checkpoint,
    Writer.come_again,
)
"""Steps that a writer may take while a part of its files is copied."""
ANOTHER_JOURNAL = (Writer.checkpoint, Writer.commit, Writer.commit_and_begin)
LATE_CHECKPOINT = (*[Writer.begin] * 3, Writer.commit, Writer.checkpoint)
LOG_GONE = (Writer.commit, Writer.checkpoint, Writer.commit, Writer.come_again, Writer.begin)


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


@pytest.mark.parametrize("journal", ["WAL", "DELETE"])
@example(before=[Writer.begin], during=ANOTHER_JOURNAL)
@example(before=[], during=LATE_CHECKPOINT)
@example(before=[Writer.commit], during=LOG_GONE)
@given(before=st.lists(st.sampled_from(STEPS), max_size=3), during=st.lists(st.sampled_from(STEPS)))
def test_a_copy_holds_a_state_that_was_written_whatever_happens_meanwhile(journal, before, during):
    with tempfile.TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / DATABASE, journal)
        for step in before:
            step(writer)
        first = len(writer.states) - 1
        meanwhile = interrupted_copies(partial(step, writer) for step in during)
        with meanwhile, open_copy(writer.path, waits=[0.0] * 20) as copy:
            assert read(copy) in writer.states[first:]
        writer.db.close()


def test_a_database_that_is_written_without_a_pause_is_refused(tmp_path):
    writer = Writer(tmp_path / DATABASE, "DELETE")
    commits = repeat(writer.commit)
    refused = pytest.raises(SpecError, match=f"{DATABASE}: another process writes")
    with refused, interrupted_copies(commits), open_copy(writer.path, waits=[0.0] * 2):
        pass
    writer.db.close()


def test_a_log_that_grows_meanwhile_is_no_reason_to_copy_again(tmp_path):
    writer = Writer(tmp_path / DATABASE, "WAL")
    commits = [writer.commit] * 20
    with interrupted_copies(commits), open_copy(writer.path, waits=[0.0]) as copy:
        assert read(copy) in writer.states
    writer.db.close()
