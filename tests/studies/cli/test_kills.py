"""Commands that are killed, or that meet each other: nothing is half there, nothing is lost."""

import csv
import hashlib
import signal
import subprocess
import time
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

import made_up
import pytest
from made_up_commands import Command, finish, run_here, wait_for_results

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import Store
from nested_agents.studies.workers.runner import save


@pytest.fixture(scope="module")
def whole(tmp_path_factory, spec_file):
    directory = tmp_path_factory.mktemp("whole") / "out"
    assert run_here(made_up.measure, "run", spec_file, "--out", directory)[0] == 0
    return directory


def content(directory):
    """Return all rows and the digest of every recording."""
    with Store.open(directory) as store:
        store.verify()
        names, rows = store.episodes()
        rows = names, list(rows)
    recordings = sorted((directory / "recordings").glob("[!.]*.npz"))
    return rows, [hashlib.sha256(path.read_bytes()).hexdigest() for path in recordings]


def kill_after(process, seconds):
    """Kill a process if it still runs; return what it said on standard error."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    return process.communicate(timeout=60)[1]


def kill_as_it_writes(process, folder):
    """Kill a process as soon as there is another file below a folder."""
    before = {*folder.rglob("*")}
    while process.poll() is None and before >= {*folder.rglob("*")}:
        time.sleep(0.0005)
    process.kill()
    process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["export", "report"])
def test_what_is_written_is_whole_or_not_there(command, whole, tmp_path):
    targets = {"export": ["episodes.csv", "trials.csv"], "report": ["page.html"]}[command]
    out = tmp_path / "out"
    option = out if command == "export" else out / "page.html"
    out.mkdir()
    line = [command, whole, "--out", option, *(["--overwrite"] if command == "export" else [])]
    begin = time.monotonic()
    assert finish(Command("measure", *line))[0] == 0
    whole_time = time.monotonic() - begin
    expected = {name: (out / name).read_bytes() for name in targets}
    before = content(whole)
    for name in targets:
        (out / name).unlink()
    for part in (0.2, 0.4, 0.7, None):
        process = Command("measure", *line)
        if part is None:
            kill_as_it_writes(process, out)
        else:
            kill_after(process, part * whole_time)
        found = {n: (out / n).read_bytes() for n in targets if (out / n).exists()}
        assert all(found[name] == expected[name] for name in found)
    assert run_here(made_up.measure, *line)[0] == 0
    assert {name: (out / name).read_bytes() for name in targets} == expected
    assert content(whole) == before


@pytest.mark.slow
def test_a_killed_retry_is_continued_by_the_same_command(spec_file, whole, tmp_path):
    assert run_here(made_up.failing, "run", spec_file, "--out", tmp_path)[0] == 1
    for seconds in (0.7, 1.5):
        kill_after(Command("slow", "retry", tmp_path), seconds)
        with Store.open(tmp_path) as store:
            store.verify()
            assert store.counts()["done"] >= 5
    assert run_here(made_up.measure, "retry", tmp_path, "--jobs", 1)[0] == 0
    assert content(tmp_path) == content(whole)


@pytest.mark.slow
def test_a_killed_explanation_is_begun_again(tmp_path):
    spec = made_up.Spec.of({"seeds": 1, "episodes": 1, "steps": 2, "evaluation": 0})
    (tmp_path / "spec.toml").write_text(dumps(spec.table()))
    study = tmp_path / "study"
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        assert main(["run", str(tmp_path / "spec.toml"), "--out", str(study), "--jobs", "1"]) == 0
    before = content(study)
    for is_writing in (False, True):
        process = Command("", "explain", study)
        if is_writing:
            kill_as_it_writes(process, study / "explain")
        else:
            kill_after(process, 0.3)
        for text in study.rglob("explanation.txt"):
            assert text.read_text().endswith("\n")
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        assert main(["explain", str(study)]) == 0
    assert content(study) == before


@pytest.mark.slow
def test_a_killed_run_leaves_no_warnings(spec_file, tmp_path):
    process = Command("endless", "run", spec_file, "--out", tmp_path, "--jobs", 2)
    wait_for_results(tmp_path, process)
    process.kill()
    _, error = process.communicate(timeout=60)  # until all who could write to it have ended
    assert "leaked" not in error
    assert "Warning" not in error


@pytest.mark.slow
def test_run_retry_and_export_at_once(spec_file, whole, tmp_path, capsys, monkeypatch):
    study, gate = tmp_path / "study", tmp_path / "gate"
    monkeypatch.setenv("MADE_UP_GATE", str(gate))
    process = Command("gated", "run", spec_file, "--out", study, "--jobs", 2)
    wait_for_results(study, process)
    exports = 0
    while process.poll() is None:
        out = tmp_path / f"export{exports}"
        assert main(["export", str(study), "--out", str(out)]) == 0
        with open(out / "trials.csv") as file:
            done = sum(row["state"] == "done" for row in csv.DictReader(file))
        with open(out / "episodes.csv") as file:
            assert len(list(csv.DictReader(file))) == done * (4 + 2)
        exports += 1
        capsys.readouterr()
        status, _, error = run_here(made_up.measure, "retry", study)
        if not gate.exists():  # so the run goes on
            assert "another process is writing" in error
            assert (status, error.count("\n")) == (2, 1)
        if exports == 2:
            gate.touch()
    assert finish(process)[0] == 0
    assert exports >= 2
    assert content(study) == content(whole)


@pytest.mark.parametrize("change", ["\r\n", "BOM"])
def test_specs_of_other_systems_mean_the_same(change, spec_file, whole, tmp_path):
    text = spec_file.read_text()
    other = "\ufeff" + text if change == "BOM" else text.replace("\n", change)
    (tmp_path / "spec.toml").write_bytes(other.encode())
    status, _, error = run_here(made_up.failing, "run", tmp_path / "spec.toml", "--out", whole)
    assert (status, error) == (0, "6 of 6 trials were run before\n")


def test_text_in_csv_is_no_formula(tmp_path, capsys):
    labels = ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "sound", "-0.5"]
    overrides = [{"name": n, "learner": {"ridge": i}} for i, n in enumerate(labels, 1)]
    spec = made_up.Spec.of({"seeds": 2, "episodes": 1, "evaluation": 0, "overrides": overrides})
    with made_up.opened(tmp_path / "study", spec) as store:
        for trial in made_up.trials_of(spec):
            save(store, trial, made_up.measure(trial), 1.0)
    study = str(tmp_path / "study")
    texts = []
    for line in (["results", study, "--format", "csv"], ["table", study, "--format", "csv"]):
        assert main(line) == 0
        texts.append(capsys.readouterr().out)
    assert main(["export", study]) == 0
    texts += [path.read_text() for path in (tmp_path / "study" / "export").glob("*.csv")]
    for text in texts:
        named = {row["condition"] for row in csv.DictReader(StringIO(text))}
        assert named == {*(f"'{label}" for label in labels[:4]), "sound", "-0.5"}
        cells = [cell for row in csv.reader(StringIO(text)) for cell in row]
        assert not [cell for cell in cells if cell.startswith(("=", "+", "@"))]
