"""A study in a folder of another machine: what its file system refuses is never damage."""

import os
import shutil
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import made_up
import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.store import connection, writer
from nested_agents.studies.store.connection import has_log, open_copy, open_to_read, open_to_write
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import NO_LOG, Store
from nested_agents.studies.workers.runner import save

NEEDS_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")

ACT = """
import sys
from pathlib import Path

import made_up
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import save

directory = Path(sys.argv[2])
if sys.argv[1] == "read":
    sys.exit(main(["results", str(directory), "--format", "csv"]))
try:
    with made_up.opened(directory) as store:
        for trial in pending(store, made_up.TRIALS)[:int(sys.argv[3])]:
            save(store, trial, made_up.measure(trial), 1.5)
        print(*store.notes, sep="\\n")
except SpecError as error:
    sys.exit(str(error))
"""


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    library = tmp_path_factory.mktemp("shim") / "no_locks.so"
    source = Path(__file__).with_name("no_locks.c")
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return library


@pytest.fixture
def act(shim):
    """Returns what an act says in a folder of some kind."""

    def run(folder, *arguments):
        paths = [str(Path(made_up.__file__).parent), os.environ.get("PYTHONPATH", "")]
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, paths)),
            "LD_PRELOAD": str(shim),
            "FOLDER": folder,
        }
        done = subprocess.run(
            [sys.executable, "-c", ACT, *map(str, arguments)],
            capture_output=True,
            text=True,
            env=environment,
        )
        return done.returncode, done.stdout, done.stderr

    return run


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
        # SQLite tries for ten seconds.
        pytest.param("shared", "there", marks=pytest.mark.slow),
        pytest.param("shared", "elsewhere", marks=pytest.mark.slow),
        pytest.param("busy", "there", marks=pytest.mark.slow),
    ],
)
def test_without_shared_memory_a_rollback_journal_keeps_the_same(
    folder, begun, act, expected, tmp_path
):
    directory = tmp_path / "no_locks" / "study"
    if begun == "elsewhere":
        with made_up.opened(directory) as store:
            save(store, made_up.TRIALS[0], made_up.measure(made_up.TRIALS[0]), 1.5)
    status, out, err = act(folder, "write", directory, 3)
    assert (status, err) == (0, "")
    assert out == f"{directory / DATABASE}: {NO_LOG}\n"
    assert act(folder, "write", directory, 6)[0] == 0
    status, out, err = act(folder, "read", directory)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 1 + 6 * 4  # of training
    assert rows(directory) == rows(expected)
    assert not list(directory.glob("*.damaged-*"))


@NEEDS_GCC
@pytest.mark.slow
def test_without_locks_one_line_says_what_to_do_and_what_is_there_is_read(act, expected, tmp_path):
    directory = tmp_path / "no_locks" / "study"
    status, out, err = act("locks", "write", directory, 1)
    assert (status, out) == (1, "")
    assert "this file system has no file locks; write on a local disk" in err
    assert err.count("\n") == 1
    shutil.rmtree(directory)
    shutil.copytree(expected, directory)
    before = (directory / DATABASE).read_bytes()
    status, out, err = act("locks", "read", directory)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 1 + 6 * 4  # of training
    assert act("locks", "write", directory, 1)[0] == 1
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


def test_a_copy_is_of_one_state_although_another_thread_writes(tmp_path):
    path = tmp_path / DATABASE
    with open_to_write(path) as db:
        db.execute("CREATE TABLE numbers (n, text)")
    ended = threading.Event()

    def write():
        with open_to_write(path) as own:
            for n in range(100):
                own.execute("BEGIN")
                own.executemany("INSERT INTO numbers VALUES (?, ?)", [(n, "x" * 500)] * 20)
                own.execute("COMMIT")
        ended.set()

    thread = threading.Thread(target=write)
    thread.start()
    while not ended.is_set():
        with open_copy(path) as copy:
            assert copy.execute("PRAGMA integrity_check(1)").fetchone() == ("ok",)
            (count,) = copy.execute("SELECT count(*) FROM numbers").fetchone()
            assert count % 20 == 0
    thread.join()
