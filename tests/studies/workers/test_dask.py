import json
import os
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from pathlib import Path

import made_up
import pytest
from made_up_commands import Command, finish

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers import dask as dask_workers
from nested_agents.studies.workers.dask import DaskWorkers
from nested_agents.studies.workers.runner import ATTEMPTS, run_trials, save

DASK = Path(sys.executable).with_name("dask")
pytestmark = pytest.mark.slow


class Cluster:
    """A scheduler and its workers as somebody would start them by hand."""

    def __init__(self, folder):
        self.folder, self.mark = folder, folder / "mark"
        self.processes = []
        self.scheduler = self.start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
            "--scheduler-file", folder / "scheduler.json",
        )  # fmt: skip
        file, deadline = folder / "scheduler.json", time.monotonic() + 60
        while not (file.exists() and file.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.05)
        self.address = json.loads(file.read_text())["address"]

    def start(self, *arguments):
        places = [str(Path(made_up.__file__).parent), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places)),
                       "MADE_UP_MARK": str(self.mark)}  # fmt: skip
        process = subprocess.Popen(
            [DASK, *map(str, arguments)], env=environment, cwd=self.folder,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def add(self, *options):
        return self.start("worker", self.address, "--no-dashboard", *options)

    def close(self):
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with closing(Cluster(tmp_path_factory.mktemp("cluster"))) as started:
        for machine in range(2):
            place = started.folder / str(machine)
            started.add("--nthreads", "1", "--local-directory", place)
        yield started


@contextmanager
def written(directory):
    with made_up.opened(directory) as store:
        yield store, pending(store, made_up.TRIALS)


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    with written(tmp_path_factory.mktemp("expected")) as (store, trials):
        for trial in trials:
            save(store, trial, made_up.measure(trial), 0.0)
        return content(store)


def content(store):
    """Rows and recordings, byte for byte."""
    recordings = sorted((store.directory / "recordings").glob("*.npz"))
    files = {path.name: path.read_bytes() for path in recordings}
    return list(store.episodes()[1]), files


def test_a_local_cluster_and_a_trial_that_kills_every_worker(tmp_path, expected):
    with DaskWorkers.local(2) as workers, written(tmp_path) as (store, trials):
        assert workers.processes == 2
        outcomes = list(run_trials(trials, store, made_up.deadly, workers))
        assert len(outcomes) == len(trials)
        ((condition, seed, error),) = store.failed()
        assert (condition, seed) == ("frozen", 1)
        assert f"died {ATTEMPTS} times" in error
        store.forget_failed()
        again = pending(store, trials)
        assert [o.error for o in run_trials(again, store, made_up.measure, workers)] == [None]
        assert content(store) == expected


def run(tmp_path, *arguments):
    spec = tmp_path / "spec.toml"
    spec.write_text(dumps(made_up.SPEC.table()))
    line = ["run", str(spec), "--out", str(tmp_path / "out"), "--backend", "dask", *arguments]
    return main(line)


@pytest.fixture
def made_up_results(monkeypatch):
    monkeypatch.setattr(learning_curve, "measure", made_up.measure)
    monkeypatch.setattr(studies_run, "check_conditions", lambda spec, **_: made_up.MEASURES)


def test_a_machine_killed_in_a_cluster_costs_its_running_trial_only(cluster, tmp_path, monkeypatch):
    made_up.write_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    command = ["run", "study.toml", "--out"]
    assert main([*command, "serial", "--jobs", "1"]) == 0
    running = Command("", *command, "cluster", "--backend", "dask", "--address", cluster.address)
    made_up.kill_group(cluster.mark, 5)
    status, _, err = finish(running)
    assert status == 0
    assert "2 processes" in " ".join(err.split())
    assert "6 of 6 trials" in err
    assert made_up.exported("cluster") == made_up.exported("serial")
    assert 6 <= len(made_up.begun(cluster.mark)) <= 6 + 1  # what it was running


@pytest.mark.usefixtures("made_up_results")
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere:-3", "tcp://", "http://x:1"])
def test_no_scheduler_there_is_one_line(tmp_path, monkeypatch, capsys, address):
    monkeypatch.setattr(dask_workers, "CONNECT_TIMEOUT_S", 0.5)
    assert run(tmp_path, "--address", address) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert f"--address {address}: " in err
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("made_up_results")
def test_dask_not_installed_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "nested_agents.studies.workers.dask")
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert run(tmp_path) == 2
    err = capsys.readouterr().err
    assert "distributed is not installed; pip install dask distributed" in err


def attempt(workers, tmp_path):
    with written(tmp_path) as (store, trials):
        return list(run_trials(trials, store, made_up.measure, workers))


def test_a_worker_with_other_versions_is_refused(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr(dask_workers, "versions", lambda: {"numpy": "0.1"})
    with (
        DaskWorkers.at(cluster.address, 1) as workers,
        pytest.raises(SpecError, match=r"the worker tcp.* has numpy .*, must be 0\.1"),
    ):
        attempt(workers, tmp_path)


def test_a_worker_with_several_threads_is_refused_and_a_lost_scheduler_is_told(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(dask_workers, "WORKER_TIMEOUT_S", 1.0)
    with closing(Cluster(tmp_path)) as other, DaskWorkers.at(other.address, None) as workers:
        with pytest.raises(SpecError, match="has had no worker for 1 s"):
            attempt(workers, tmp_path / "a")
        monkeypatch.setattr(dask_workers, "WORKER_TIMEOUT_S", 30.0)
        other.add("--nthreads", "2")
        with pytest.raises(SpecError, match="has 2 threads, must be 1: start dask worker with"):
            attempt(workers, tmp_path / "b")
        other.scheduler.kill()
        with pytest.raises(SpecError, match="is gone; finished trials are stored"):
            attempt(workers, tmp_path / "c")
