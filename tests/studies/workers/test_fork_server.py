"""Each trial of a user's files has a process to itself, forked from one in which none has run."""

import os
import pickle
import signal
import time
from dataclasses import replace
from pathlib import Path

import made_up
import made_up_harm
import pytest
from made_up_commands import Command

import nested_agents as na
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers import fork_server
from nested_agents.studies.workers.fork_server import call_for, outcome_of, run_in_own_process
from nested_agents.studies.workers.runner import ATTEMPTS, Outcome, attempt
from nested_agents.studies.workers.workers import LokyWorkers

TRIAL = made_up.TRIALS[0]


def run_apart(function, trial=TRIAL) -> Outcome:
    return outcome_of(run_in_own_process(pickle.dumps((function, trial)), trial.seed), trial)


def test_only_trials_that_run_files_of_a_user_have_a_process_each() -> None:
    assert call_for(made_up.measure, TRIAL) == (attempt, made_up.measure, TRIAL)
    files = Sources(None, {"graph.json": "[]"})
    own = replace(TRIAL, sources=files)
    assert call_for(made_up.measure, own)[0] is attempt
    own = replace(TRIAL, sources=Sources(None, {"arm.py": "x = 1"}))
    assert call_for(made_up.measure, own)[0] is run_in_own_process


def test_a_trial_finds_what_the_first_one_found() -> None:
    first = run_apart(made_up_harm.innocent)
    assert first.error is None
    assert first.result.numbers["sum"] == 2.0
    assert first.result.numbers["trials"] == 1
    assert run_apart(made_up_harm.harmful).result.numbers == first.result.numbers
    assert run_apart(made_up_harm.innocent).result.numbers == first.result.numbers
    other = run_apart(made_up_harm.innocent, made_up.TRIALS[2]).result.numbers
    assert other["random"] != first.result.numbers["random"]
    assert other["numpy"] != first.result.numbers["numpy"]


def test_another_fork_server_gives_the_same() -> None:
    first = run_apart(made_up_harm.innocent).result.numbers
    fork_server._start_server.cache_clear()
    assert run_apart(made_up_harm.innocent).result.numbers == first


def test_the_process_that_forks_has_one_thread_and_runs_no_trial() -> None:
    told = [run_apart(made_up_harm.tells_parents).result.numbers for _ in range(2)]
    assert {numbers["threads"] for numbers in told} == {1.0}
    assert len({numbers["parent"] for numbers in told}) == 1
    assert len({numbers["own"] for numbers in told}) == 2


def test_the_second_trial_need_not_import_what_the_first_did() -> None:
    trial = trials_of(made_up.Spec.of({"episodes": 1, "steps": 2, "scenario": {"kind": "line-up"}}))
    from nested_agents.studies.catalogue.study import measure

    for _ in range(2):
        run_apart(measure, trial[0])
    begin = time.perf_counter()
    seconds = run_apart(measure, trial[0]).seconds
    assert time.perf_counter() - begin - seconds < 2.0  # of a busy machine; usually 0.03


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (made_up_harm.exits, "exit code 3"),
        (made_up_harm.crashes, "killed by SIGSEGV"),
        (made_up_harm.leaves_and_crashes, "killed by SIGSEGV"),
        (made_up.deadly, "killed by SIGKILL, as when memory is short"),
    ],
)
def test_how_a_process_died_is_told(function, reason) -> None:
    trial = next(t for t in made_up.TRIALS if (t.condition, t.seed) == ("frozen", 1))
    outcome = run_apart(function, trial)
    assert (outcome.lost, outcome.error) == (True, reason)
    assert run_apart(made_up_harm.innocent).error is None


def test_a_process_that_is_left_behind_is_not_waited_for() -> None:
    begin = time.monotonic()
    assert run_apart(made_up_harm.leaves).error is None
    assert time.monotonic() - begin < 3.0


def test_what_cannot_be_pickled_fails_its_trial() -> None:
    outcome = run_apart(made_up_harm.odd)
    assert not outcome.lost
    assert "odd.<locals>.<lambda>" in outcome.error.splitlines()[-1]


def test_what_it_prints_is_printed(capfd) -> None:
    fork_server._start_server.cache_clear()
    assert run_apart(made_up_harm.prints).error is None
    out, err = capfd.readouterr()
    assert out == "I speak\n"
    assert "I complain\n" in err


def test_a_killed_fork_server_costs_its_trial_and_another_starts() -> None:
    run_apart(made_up_harm.innocent)
    process, _ = fork_server._start_server(os.getpid())
    process.kill()
    process.wait()
    assert run_apart(made_up_harm.innocent) == Outcome(
        TRIAL, "the process that starts trials has died", 0.0, lost=True
    )
    assert run_apart(made_up_harm.innocent).error is None


def test_an_answer_is_what_became_of_a_trial() -> None:
    answer = pickle.dumps((None, 1.5, None)), ""
    assert outcome_of(answer, TRIAL) == Outcome(TRIAL, None, 1.5)


STATE = """
import os
import random
import signal

import numpy as np

from nested_agents.scenarios.line_up import LineUp, LineUpSettings

RNG = np.random.default_rng(0)


class Stateful(LineUp):
    class Settings(LineUpSettings):
        carts: int = 2
        dies: str = ""

    def __init__(self, settings):
        super().__init__(settings)
        self.dies = settings.dies

    def reset(self, seed, episode=0):
        if self.dies == "exit":
            os._exit(7)
        if self.dies == "killed":
            os.kill(os.getpid(), signal.SIGABRT)
        super().reset(seed, episode)
        shape = self._places.shape
        self._places = self._places + 0.05 * RNG.standard_normal(shape) + 0.01 * random.random()
        self._places = self._places + 0.01 * np.random.random(shape)
        return self._states()
"""


def write(folder: Path, more: str = "seeds = 4") -> Path:
    (folder / "state.py").write_text(STATE)
    path = folder / "spec.toml"
    path.write_text(
        'study = "learning-curve"\nepisodes = 2\nsteps = 5\nevaluation = 1\n'
        f'scenario.kind = "state.py:Stateful"\n{more}\n'
    )
    return path


def rows(directory: Path) -> list[tuple[object, ...]]:
    with Store.open(directory) as store:
        return list(store.episodes()[1])


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> list[tuple[object, ...]]:
    folder = tmp_path_factory.mktemp("alone")
    na.run(write(folder), folder / "out", jobs=1, progress=False)
    return rows(folder / "out")


@pytest.mark.parametrize(
    "options",
    [
        {"jobs": 2},
        {"jobs": 3},
        pytest.param({"jobs": 2, "backend": "dask"}, marks=pytest.mark.slow),
    ],
)
def test_rows_do_not_depend_on_who_runs_what_after_what(options, alone, tmp_path) -> None:
    na.run(write(tmp_path), tmp_path / "out", progress=False, **options)
    assert rows(tmp_path / "out") == alone


@pytest.mark.parametrize(
    ("dies", "reason"), [("exit", "exit code 7"), ("killed", "killed by SIGABRT")]
)
def test_a_trial_that_dies_costs_no_other(dies, reason, tmp_path, capsys) -> None:
    spec = write(tmp_path, f'seeds = [1]\nsweep."scenario.dies" = ["", "{dies}"]')
    assert main(["run", str(spec), "--out", str(tmp_path / "out")]) == 1
    with Store.open(tmp_path / "out") as store:
        assert store.counts() == {"done": 1, "failed": 1}
        ((_, seed, error),) = store.failed()
    assert (seed, error) == (1, f"its worker died {ATTEMPTS} times: {reason}")


def test_of_a_worker_it_is_told_too_and_nothing_that_loky_advises() -> None:
    workers = LokyWorkers(1)
    trial = next(t for t in made_up.TRIALS if (t.condition, t.seed) == ("frozen", 1))
    (outcome,) = workers.arrivals([trial], made_up_harm.exits, print, print)
    assert (outcome.lost, outcome.error) == (True, "exit code 3")
    (outcome,) = workers.arrivals([trial], made_up_harm.crashes, print, print)
    assert (outcome.lost, outcome.error) == (True, "killed by SIGSEGV")


SLOW = (
    STATE
    + """
    def step(self, joint_action):
        with open(os.environ["MADE_UP_MARK"], "a") as file:
            file.write(f"{os.getpid()} {os.getppid()} ")
        signal.pause()
"""
)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_no_process_outlives_the_command(number, tmp_path, monkeypatch) -> None:
    (tmp_path / "state.py").write_text(SLOW)
    spec = write(tmp_path)
    (tmp_path / "state.py").write_text(SLOW)
    mark = tmp_path / "mark"
    monkeypatch.setenv("MADE_UP_MARK", str(mark))
    parent = Command("", "run", spec, "--out", tmp_path / "out", "--jobs", 2)
    until = time.monotonic() + 60
    while time.monotonic() < until and not (mark.exists() and len(mark.read_text().split()) >= 4):
        time.sleep(0.05)
    processes = {int(pid) for pid in mark.read_text().split()}
    assert len(processes) == 4
    os.kill(parent.pid, number)
    parent.wait(60)
    while time.monotonic() < until and any(Path(f"/proc/{pid}").exists() for pid in processes):
        time.sleep(0.1)
    assert [pid for pid in processes if Path(f"/proc/{pid}").exists()] == []
    parent.communicate()
