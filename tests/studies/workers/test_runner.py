import os
import subprocess
import sys
import textwrap
import time
import warnings
from pathlib import Path

import made_up
import pytest
from joblib.externals.loky import get_reusable_executor

from nested_agents.studies.errors import SpecError
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import ATTEMPTS, run_trials
from nested_agents.studies.workers.workers import REPLACED, LokyWorkers, start_workers


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
        assert store.forget_failed() == 1
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


def test_workers_compute_with_one_thread(tmp_path):
    for jobs in (1, 2):
        with made_up.opened(tmp_path / str(jobs)) as store:
            workers = LokyWorkers(jobs)
            outcomes = list(run_trials(made_up.TRIALS[:2], store, made_up.threads, workers))
            assert [o.error for o in outcomes] == [None, None]


def test_workers_do_not_outlive_a_killed_parent(tmp_path):
    program = """
        import sys
        import made_up
        from nested_agents.studies.workers.workers import LokyWorkers
        from nested_agents.studies.workers.runner import run_trials
        from pathlib import Path
        with made_up.opened(Path(sys.argv[1])) as store:
            for _ in run_trials(made_up.TRIALS, store, made_up.pids, LokyWorkers(2)):
                pass
    """
    environment = {**os.environ, "PYTHONPATH": str(Path(made_up.__file__).parent),
                   "MADE_UP_MARK": str(tmp_path / "pids")}  # fmt: skip
    command = [sys.executable, "-c", textwrap.dedent(program), str(tmp_path / "study")]
    parent = subprocess.Popen(command, env=environment)
    deadline = time.monotonic() + 60
    while not (tmp_path / "pids").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    workers = {int(line) for line in (tmp_path / "pids").read_text().split()}
    assert workers
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert [pid for pid in workers if Path(f"/proc/{pid}").exists()] == []


def test_never_more_trials_are_said_to_run_than_there_are_processes():
    started, left = [], set(made_up.TRIALS)
    for arrival in LokyWorkers(2).arrivals(made_up.TRIALS, made_up.slow, started.append):
        left.remove(arrival.trial)
        running = [trial for trial in left if trial.identity in started]
        assert len(running) == min(1, len(left))  # the next is handed out once this one is kept
    assert len(started) == len(set(started)) == len(made_up.TRIALS)


def test_whoever_stops_waits_for_no_trial():
    arriving = LokyWorkers(2).arrivals(made_up.TRIALS, made_up.endless, lambda _: None)
    assert {next(arriving).error, next(arriving).error} == {None}
    begin = time.monotonic()
    arriving.close()
    assert time.monotonic() - begin < 60


@pytest.mark.parametrize(("jobs", "trials", "expected"), [(512, 3, 3), (1, 3, 1), (2, 0, 1)])
def test_no_more_workers_than_trials(jobs, trials, expected):
    with start_workers("loky", jobs, None, trials) as workers:
        assert workers.processes == expected


def test_an_unknown_backend_is_refused() -> None:
    refused = pytest.raises(SpecError, match="backend = 'ray': known: dask, loky")
    with refused, start_workers("ray", 1, None, 1):  # type: ignore[arg-type]
        pass


def test_what_loky_says_of_a_process_that_it_replaces_is_not_shown(recwarn) -> None:
    LokyWorkers(1)
    warnings.warn(f"{REPLACED}. This can be caused by ...", UserWarning, stacklevel=1)
    assert not recwarn
