import contextlib
import re
import subprocess
from contextlib import contextmanager

import made_up
import pytest

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import Store
from nested_agents.studies.workers.runner import attempt

FREE_STEP_BYTES = 24_576
"""Additional free space from one attempt to the next [bytes]."""


class Here:
    """Runs trials in this process."""

    processes = 1

    def arrivals(self, trials, measure, started, ended):
        for trial in trials:
            started(trial.identity)
            yield attempt(measure, trial)


@pytest.fixture
def disk(tmp_path):
    """A real file system of 512 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", folder]
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("mount is not installed")
    if done.returncode:
        pytest.skip(f"may not mount: {done.stderr.strip()}")
    yield folder
    subprocess.run(["umount", folder], check=True)


@contextmanager
def ballast(disk, free):
    """Leave `free` bytes while the context lasts."""
    path = disk / "ballast"
    with open(path, "wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))
    with open(path, "r+b") as file:
        file.truncate(path.stat().st_size - free)
    yield
    path.unlink()


def content(directory):
    with Store.open(directory) as store:
        store.verify()
        rows = list(store.episodes()[1])
    return rows, {p.name: p.read_bytes() for p in (directory / "recordings").iterdir()}


def done(directory, capsys):
    """Return the rows that can be read, and how many trials `status` says are done."""
    capsys.readouterr()
    assert main(["results", str(directory), "--format", "csv"]) == 0
    rows = capsys.readouterr().out.splitlines()[1:]
    assert main(["status", str(directory)]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("done")]
    return rows, int(line.split()[1])


def test_a_full_disk_stops_a_study_with_one_line_and_costs_nothing(
    disk, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(learning_curve, "measure", made_up.measure)
    monkeypatch.setattr(studies_run, "check_conditions", lambda spec, **_: made_up.MEASURES)
    monkeypatch.setattr(studies_run, "start_workers", lambda *_: contextlib.nullcontext(Here()))
    # Figures are no results: without them the disk need not be larger.
    monkeypatch.setattr(learning_curve, "draw", lambda analysis: {})
    spec = tmp_path / "spec.toml"
    spec.write_text(dumps(made_up.SPEC.table()))
    assert main(["run", str(spec), "--out", str(tmp_path / "expected")]) == 0
    expected = content(tmp_path / "expected")
    whole, _ = done(tmp_path / "expected", capsys)
    kept = set()
    for free in range(0, 400_000, FREE_STEP_BYTES):
        directory = disk / str(free)
        line = ["run", str(spec), "--out", str(directory)]
        with ballast(disk, free):
            status = main(line)
            error = capsys.readouterr().err.splitlines()
            if status == 0:
                break
            assert status == 2
            said = [text for text in error if text.startswith("nested-agents: error: ")]
            assert said == error[-1:]
            assert re.search("No space left on device|disk is full|kB free on this disk", said[0])
            if list(directory.glob("recordings/*.npz")):
                rows, count = done(directory, capsys)
                assert len(rows) == 4 * count
                assert set(rows) <= set(whole)
                kept.add(count)
        assert main(line) == 0
        assert content(directory) == expected
        subprocess.run(["rm", "-r", directory], check=True)
    assert status == 0, "the disk was never large enough"
    assert any(0 < count < len(made_up.TRIALS) for count in kept), "no trial was kept"
    assert len(kept) > 1
