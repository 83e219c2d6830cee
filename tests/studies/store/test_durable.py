"""Files that would make their reader wait, or never end, are refused."""

import os
import resource
import socket
import subprocess
import sys

import made_up
import pytest

from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.report import page
from nested_agents.studies.store import durable
from nested_agents.studies.store.database import DATABASE, SPEC_FILE
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import LOCK
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import save

pytestmark = pytest.mark.timeout(120)


def pipe(path):
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def endless(path):
    path.unlink(missing_ok=True)
    path.symlink_to("/dev/zero")


def plug(path):
    path.unlink(missing_ok=True)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(os.path.relpath(path))  # a name of few characters


def huge(path):
    with open(path, "ab") as file:
        file.truncate(2**40)


ODD = {
    pipe: "is a pipe, a socket or a device, not a file",
    endless: "is a pipe, a socket or a device, not a file",
    plug: "is a pipe, a socket or a device, not a file",
    huge: f"is larger than allowed, {2**30} bytes",
}


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with made_up.opened(tmp_path / "study") as store:
        for trial in pending(store, made_up.TRIALS):
            save(store, trial, made_up.measure(trial), 1.5)
    return tmp_path / "study"


@pytest.mark.parametrize("make", ODD)
def test_what_is_no_file_is_not_read(make, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make(tmp_path / "odd")
    for read in (durable.read_bytes, durable.read_text, durable.check_file):
        with pytest.raises(OSError, match=ODD[make]):
            read(tmp_path / "odd")
    with pytest.raises(SpecError, match=f"odd: {ODD[make]}"):
        durable.read_checked(tmp_path / "odd", "digest")


@pytest.mark.parametrize("make", ODD)
@pytest.mark.parametrize("line", ["run {} --out new", "check {}", "plan {}"])
def test_a_spec_that_is_no_file_is_one_line(make, line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make(tmp_path / "odd.toml")
    assert main(line.format("odd.toml").split()) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert f"odd.toml: {ODD[make]}" in err
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("make", [pipe, endless, plug])
@pytest.mark.parametrize("name", [LOCK, DATABASE, SPEC_FILE])
def test_a_file_of_a_study_that_is_none_is_told_or_not_needed(make, name, study, capsys):
    expected = {}
    for line in ("status", "results --format csv", "table"):
        command, *options = line.split()
        main([command, str(study), *options])
        expected[line] = capsys.readouterr().out
    make(study / name)
    for line, whole in expected.items():
        command, *options = line.split()
        status = main([command, str(study), *options])
        out, err = capsys.readouterr()
        assert out == whole or name in out + err
        assert (status, err.count("\n")) in ((0, 0), (0, 1), (2, 1))


@pytest.mark.parametrize("make", [pipe, huge])
def test_a_recording_that_is_no_file_is_damaged_and_never_waited_for(
    make, study, capsys, monkeypatch
):
    monkeypatch.setattr(learning_curve, "draw", lambda analysis: {})
    monkeypatch.setattr(page, "hierarchy_pictures", lambda store: ([], ""))
    for recording in (study / "recordings").glob("*.npz"):
        make(recording)
    with Store.open(study) as store:
        assert all(f".npz: {ODD[make]} (" in line for line in store.damage().values())
        assert store.damage()
    assert main(["report", str(study)]) == 0
    assert "Traceback" not in "".join(capsys.readouterr())
    assert "the recording is missing or damaged" in (study / "report.html").read_text()


@pytest.mark.parametrize("megabytes", [100, 400, 900])
def test_a_limit_of_the_shell_is_said_before_anything_runs(megabytes, study):
    done = subprocess.run(
        [sys.executable, "-m", "nested_agents", "table", str(study)],
        capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes * 10**6,) * 2),
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "ulimit -v" in done.stderr
    assert "must be at least" in done.stderr
