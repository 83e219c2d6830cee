"""Trials run on workers, whatever happens to them; a trial fails with its traceback."""

import errno
import os
import signal
import time
import warnings
from pathlib import Path

import made_up
import pytest
from joblib.externals.loky import get_reusable_executor
from made_up_commands import Command

from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers import workers
from nested_agents.studies.workers.runner import (
    ATTEMPTS,
    MAX_ERROR_LENGTH,
    ONE_THREAD,
    attempt,
    run_trials,
)
from nested_agents.studies.workers.workers import (
    REPLACED_WARNING,
    Backend,
    LokyWorkers,
    ShortFirst,
    check_workers,
    start_workers,
)


def content(store):
    names, rows = store.episodes()
    return names, list(rows)


def run(directory, measure, jobs=2):
    with made_up.opened(directory) as store:
        left = pending(store, made_up.TRIALS)
        outcomes = list(run_trials(left, store, measure, LokyWorkers(jobs)))
        return outcomes, content(store), store.failed()


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    _, rows, _ = run(tmp_path_factory.mktemp("whole"), made_up.measure, jobs=1)
    return rows


def test_one_and_two_jobs_give_the_same_rows_and_recordings(tmp_path, uninterrupted):
    outcomes, rows, failed = run(tmp_path, made_up.measure, jobs=2)
    assert len(outcomes) == len(made_up.TRIALS)
    assert rows == uninterrupted
    assert failed == []
    names, episodes = rows
    assert names[:3] == ["condition", "preset", "seed"]
    assert len(episodes) == 6 * 4 + 6 * 2


def test_results_are_kept_one_by_one_and_the_rest_runs_later(tmp_path, uninterrupted):
    with made_up.opened(tmp_path) as store:
        running = run_trials(pending(store, made_up.TRIALS), store, made_up.slow, LokyWorkers(2))
        first = next(running)
        assert store.counts()["done"] >= 1
        running.close()
        left = pending(store, made_up.TRIALS)
        assert first.trial not in left
        assert 0 < len(left) < len(made_up.TRIALS)
    outcomes, rows, _ = run(tmp_path, made_up.measure)
    assert [o.trial for o in outcomes if o.trial not in left] == []
    assert rows == uninterrupted


def test_an_interrupt_while_a_trial_is_handed_to_a_worker_is_for_the_parent(tmp_path, monkeypatch):
    submit, futures = LokyWorkers.submit, []

    def interrupted(self, *arguments):
        os.kill(os.getpid(), signal.SIGINT)
        futures.append(submit(self, *arguments))
        for process in list(self._executor._processes):
            os.kill(process, signal.SIGINT)
        return futures[-1]

    monkeypatch.setattr(LokyWorkers, "submit", interrupted)
    with made_up.opened(tmp_path) as store, pytest.raises(KeyboardInterrupt):
        list(run_trials(pending(store, made_up.TRIALS), store, made_up.endless, LokyWorkers(2)))
    (future,) = futures
    assert "SIGINT" not in str(future.exception())  # stopped, not interrupted


def test_a_failed_trial_is_kept_with_its_traceback_and_the_others_go_on(tmp_path):
    outcomes, rows, failed = run(tmp_path, made_up.failing)
    assert len(outcomes) == len(made_up.TRIALS)
    ((condition, seed, error),) = failed
    assert (condition, seed) == ("frozen", 1)
    assert "in failing" in error
    assert error.rstrip().endswith("RuntimeError: a wheel came off")
    assert len(rows[1]) == 5 * 4 + 5 * 2


def test_a_failed_trial_is_run_again_only_on_request(tmp_path, uninterrupted):
    run(tmp_path, made_up.failing)
    outcomes, _, _ = run(tmp_path, made_up.measure)
    assert outcomes == []
    with made_up.opened(tmp_path) as store:
        store.forget_failed()
    outcomes, rows, failed = run(tmp_path, made_up.measure)
    assert (len(outcomes), failed, rows) == (1, [], uninterrupted)


def test_a_killed_worker_costs_nothing(tmp_path, monkeypatch, uninterrupted):
    monkeypatch.setenv("MADE_UP_MARK", str(tmp_path / "mark"))
    get_reusable_executor().shutdown(
        kill_workers=True
    )  # workers have the environment of their birth
    outcomes, rows, failed = run(tmp_path / "study", made_up.deadly_once)
    assert (tmp_path / "mark").exists()
    assert sorted(o.trial.identity for o in outcomes) == sorted(t.identity for t in made_up.TRIALS)
    assert (rows, failed) == (uninterrupted, [])


def test_a_trial_that_kills_every_worker_fails_alone(tmp_path):
    outcomes, _, failed = run(tmp_path, made_up.deadly)
    assert len(outcomes) == len(made_up.TRIALS)
    ((condition, seed, error),) = failed
    assert (condition, seed) == ("frozen", 1)
    assert f"died {ATTEMPTS} times" in error


def test_workers_compute_with_one_thread(tmp_path, monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)  # ./dev test sets it
    for jobs in (1, 2):
        with made_up.opened(tmp_path / str(jobs)) as store:
            workers = LokyWorkers(jobs)
            outcomes = list(run_trials(made_up.TRIALS[:2], store, made_up.threads, workers))
            assert [o.error for o in outcomes] == [None, None]


def test_workers_do_not_outlive_a_killed_parent(tmp_path, monkeypatch):
    (tmp_path / "spec.toml").write_text(dumps(made_up.SPEC.table()))
    monkeypatch.setenv("MADE_UP_MARK", str(tmp_path / "pids"))
    arguments = ["run", tmp_path / "spec.toml", "--out", tmp_path / "study", "--jobs", 2]
    parent = Command("pids", *arguments)
    deadline = time.monotonic() + 60
    while not (tmp_path / "pids").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    parent.kill()
    parent.wait(60)
    workers = {int(line) for line in (tmp_path / "pids").read_text().split()}
    assert workers
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert [pid for pid in workers if Path(f"/proc/{pid}").exists()] == []
    parent.communicate()


def test_never_more_trials_are_said_to_run_than_there_are_processes():
    started, running = [], set()

    def begin(identity):
        started.append(identity)
        running.add(identity)
        assert len(running) <= 2

    arriving = LokyWorkers(2).arrivals(made_up.TRIALS, made_up.slow, begin, running.remove)
    for at, _ in enumerate(arriving, 1):  # the next is handed out before this one is kept
        assert len(running) == min(2, len(made_up.TRIALS) - at)
    assert len(started) == len(set(started)) == len(made_up.TRIALS)


def test_whoever_stops_waits_for_no_trial():
    arriving = LokyWorkers(2).arrivals(made_up.TRIALS, made_up.endless, print, print)
    assert {next(arriving).error, next(arriving).error} == {None}
    begin = time.monotonic()
    arriving.close()
    assert time.monotonic() - begin < 60


def test_short_trials_need_no_worker_and_give_the_same_rows(tmp_path, monkeypatch, uninterrupted):
    with made_up.opened(tmp_path / "study") as store, monkeypatch.context() as patch:
        patch.setattr(LokyWorkers, "submit", None)
        outcomes = list(run_trials(made_up.TRIALS, store, made_up.measure, ShortFirst(2)))
        assert [o.error for o in outcomes] == [None] * len(made_up.TRIALS)
        assert content(store) == uninterrupted


@pytest.mark.parametrize("limit", ["HERE_S", "MAX_SHORT_DECISIONS"])
def test_trials_that_are_not_short_run_on_workers(monkeypatch, limit):
    monkeypatch.setattr(workers, limit, 0)
    monkeypatch.setattr(workers, "attempt", None)  # of this process
    outcomes = [*ShortFirst(2).arrivals(made_up.TRIALS[:2], made_up.measure, print, print)]
    assert [outcome.error for outcome in outcomes] == [None, None]


def test_ctrl_c_in_a_short_trial_interrupts_the_study_and_fails_no_trial(tmp_path):
    def interrupted(trial):
        raise KeyboardInterrupt

    with made_up.opened(tmp_path) as store:
        with pytest.raises(KeyboardInterrupt):
            list(run_trials(made_up.TRIALS, store, interrupted, ShortFirst(2)))
        assert store.failed() == []


@pytest.mark.parametrize("name", ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"])
def test_a_process_of_many_threads_or_a_number_of_jobs_calls_for_workers(monkeypatch, name):
    for variable in ONE_THREAD:
        monkeypatch.setenv(variable, "1")
    with start_workers("loky", None, None, 2) as short, start_workers("loky", 2, None, 2) as jobs:
        assert [type(short), type(jobs)] == [ShortFirst, LokyWorkers]
    monkeypatch.delenv(name)
    with start_workers("loky", None, None, 2) as several:
        assert type(several) is LokyWorkers


@pytest.mark.parametrize(("jobs", "trials", "expected"), [(512, 3, 3), (1, 3, 1), (2, 0, 1)])
def test_no_more_workers_than_trials(jobs, trials, expected):
    with start_workers("loky", jobs, None, trials) as workers:
        assert workers.processes == expected


def test_an_unknown_backend_is_refused() -> None:
    refused = pytest.raises(SpecError, match="backend = 'ray': known: dask, loky")
    with refused, start_workers("ray", 1, None, 1):  # type: ignore[arg-type]
        pass


@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_a_machine_without_shared_memory_is_told_before_anything_is_written(
    backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: str) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(workers, "get_context", refuse)
    with pytest.raises(SpecError, match="/dev/shm: Read-only file system: the processes that"):
        check_workers(backend, 1, None)
    check_workers("dask", None, "tcp://elsewhere:8786")


def test_what_loky_says_of_a_process_that_it_replaces_is_not_shown(recwarn) -> None:
    LokyWorkers(1)
    warnings.warn(f"{REPLACED_WARNING}. This can be caused by ...", UserWarning, stacklevel=1)
    assert not recwarn


class OddError(BaseException):
    pass


@pytest.mark.parametrize(
    "raised", [SystemExit(0), SystemExit(3), KeyboardInterrupt(), OddError("odd")]
)
def test_what_is_no_exception_fails_a_trial_too(raised: BaseException) -> None:
    def measure(trial):
        raise raised

    arrival = attempt(measure, made_up.TRIALS[0])
    assert arrival.result is None
    assert type(raised).__name__ in arrival.error.splitlines()[-1]


@pytest.mark.parametrize("message", ["\ud800 alone", "long " * 600_000])
def test_any_message_can_be_stored_and_is_short(tmp_path, message: str) -> None:
    def measure(trial):
        raise ValueError(message)

    arrival = attempt(measure, made_up.TRIALS[0])
    assert len(arrival.error.encode()) < 2 * MAX_ERROR_LENGTH
    with made_up.opened(tmp_path) as store:
        store.fail(arrival.trial, arrival.error)
        assert len(store.failed()) == 1


QUITS = """
import sys
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Settings(LineUpSettings):
    when: str = "step"

class Quits(LineUp):
    Settings = Settings

    def __init__(self, settings):
        super().__init__(settings)
        self.when = settings.when
        if self.when == "begin":
            sys.exit(0)
        if self.when == "error":
            raise TypeError("no speeds")

    def step(self, joint_action):
        sys.exit(0)
"""


def spec(tmp_path, when: str) -> str:
    (tmp_path / "quits.py").write_text(QUITS)
    (tmp_path / "spec.toml").write_text(
        f"""
        seeds = 2
        episodes = 1
        steps = 2
        evaluation = 1
        [[overrides]]
        name = "quits"
        scenario = {{ kind = "quits.py:Quits", when = "{when}" }}
        [[overrides]]
        name = "works"
        scenario = {{ kind = "line-up" }}
        """
    )
    return str(tmp_path / "spec.toml")


def test_a_scenario_that_quits_fails_its_trials_and_no_others(tmp_path, capsys) -> None:
    study = tmp_path / "study"
    assert main(["run", spec(tmp_path, "step"), "--out", str(study), "--jobs", "1"]) == 1
    assert "SystemExit: 0" in capsys.readouterr().err
    with Store.open(study) as store:
        assert store.counts() == {"done": 2, "failed": 2}


@pytest.mark.parametrize(("when", "failed"), [("begin", "SystemExit: 0"), ("error", "no speeds")])
def test_a_scenario_that_cannot_be_built_fails_its_trials_and_no_others(
    tmp_path, capsys, when: str, failed: str
) -> None:
    study = tmp_path / "study"
    assert main(["run", spec(tmp_path, when), "--out", str(study), "--jobs", "1"]) == 1
    assert failed in capsys.readouterr().err
    with Store.open(study) as store:
        assert store.counts() == {"done": 2, "failed": 2}
    assert main(["plan", str(tmp_path / "spec.toml")]) == 2
    error = capsys.readouterr().err
    assert "(condition 'quits')" in error
    assert error.count("\n") == 1


RAISES = {
    "raise RuntimeError('no power')": "RuntimeError: no power in line 9 of raises.py",
    "{}['power']": "KeyError: 'power' in line 9 of raises.py",
    "raise Mute": "Mute: in line 9 of raises.py",
    "raise Odd": "Odd: in line 9 of raises.py",
    "return 0": "TypeError: __init__() should return None, not 'int'",
}
BUILT = """from nested_agents.scenarios.line_up import LineUp, LineUpSettings
class Mute(Exception):
    def __str__(self): raise RuntimeError
class Odd(BaseException): pass
class Raises(LineUp):
    class Settings(LineUpSettings): pass
    def __init__(self, settings):
        super().__init__(settings)
        {}
"""


@pytest.mark.parametrize("act", RAISES)
def test_whatever_a_scenario_raises_when_it_is_built_is_one_line(act, tmp_path, capsys) -> None:
    (tmp_path / "raises.py").write_text(BUILT.replace("{}", act, 1))
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == 2
    error = capsys.readouterr().err
    assert f" raises {RAISES[act]}" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("act", "status", "line"),
    [
        ("raise ValueError('no power')", 2, "error: no power, in line 9 of raises.py"),
        ("raise KeyboardInterrupt", 130, "interrupted in line 9 of raises.py"),
    ],
)
def test_its_own_words_and_an_interruption_have_their_line(
    act, status, line, tmp_path, capsys
) -> None:
    (tmp_path / "raises.py").write_text(BUILT.replace("{}", act, 1))
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == status
    assert capsys.readouterr().err == f"nested-agents: {line}\n"
    assert not (tmp_path / "study").exists()


def test_what_a_scenario_raises_on_being_asked_is_one_line_too(tmp_path, capsys) -> None:
    text = BUILT.replace("{}", "pass", 1) + "    measures = property(lambda self: 1 / 0)\n"
    (tmp_path / "raises.py").write_text(text)
    spec = tmp_path / "spec.toml"
    spec.write_text('[scenario]\nkind = "raises.py:Raises"\n')
    assert main(["run", str(spec), "--out", str(tmp_path / "study")]) == 2
    error = capsys.readouterr().err
    assert "raises ZeroDivisionError: division by zero in line 10 of raises.py" in error
