"""Runs trials in worker processes and keeps every result the moment it arrives.

Workers are separate processes even for one job: a crash in native code costs one trial, and the
number of threads that linear algebra uses, on which last bits depend, is always one. A trial whose
worker is killed is run again, alone, up to `ATTEMPTS` times.
"""

from __future__ import annotations

import os
import signal
import threading
import warnings
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

import joblib
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from .store import Store
from .trial import Trial, TrialResult
from .worker import Arrival, Measure, attempt, begin

ATTEMPTS = 2
"""How often a trial is run whose worker dies while nothing else runs."""


@dataclass(frozen=True)
class Outcome:
    """What became of a trial: its result is in the store already.

    Attributes
    ----------
    trial
        The trial.
    error
        The traceback, if it failed.
    seconds
        How long it took.
    """

    trial: Trial
    error: str | None
    seconds: float


def run_trials(
    trials: Sequence[Trial], store: Store, measure: Measure, jobs: int
) -> Generator[Outcome]:
    """Run trials in parallel; store, then yield each as it finishes.

    Closing the generator, or an exception in its consumer, stops the workers at once.

    Parameters
    ----------
    trials
        The trials to run, for instance `Store.pending`.
    store
        Where results and tracebacks are kept.
    measure
        Runs one trial; a module-level function, since workers import it by name.
    jobs
        Number of worker processes that are busy at a time, at least 1.

    Raises
    ------
    ValueError
        If `jobs` is less than 1.
    """
    if jobs < 1:
        raise ValueError(f"jobs = {jobs}: must be at least 1")
    queue = list(trials)
    while queue:
        started: list[Trial] = []
        finished: set[str] = set()
        try:
            with closing(_parallel(queue, measure, jobs, started)) as arriving:
                for trial, result, error, seconds in arriving:
                    finished.add(trial.identity)
                    yield _keep(store, trial, result, error, seconds)
        except TerminatedWorkerError:
            for suspect in [t for t in started if t.identity not in finished]:
                finished.add(suspect.identity)
                yield _alone(suspect, store, measure)
        queue = [trial for trial in queue if trial.identity not in finished]


def _parallel(
    trials: Sequence[Trial], measure: Measure, jobs: int, started: list[Trial]
) -> Generator[Arrival]:
    """Yield results in order of arrival; `started` receives each trial as it is handed out."""

    def tasks() -> Iterator[Any]:
        for trial in trials:
            started.append(trial)
            yield joblib.delayed(attempt)(measure, trial)

    worker = {"initializer": begin, "initargs": (os.getpid(),)}
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1, **worker):
        # joblib runs a single job in this process: ask for two workers and feed them singly.
        parallel = joblib.Parallel(
            n_jobs=max(jobs, 2), pre_dispatch=jobs, batch_size=1, return_as="generator_unordered"
        )
        with _deaf():
            arriving = parallel(tasks())
    try:
        # Not `yield from`, which would close `arriving` before we can.
        for arrival in arriving:  # noqa: UP028
            yield arrival
    except (GeneratorExit, KeyboardInterrupt):
        with warnings.catch_warnings():
            # That tasks are left undone is what closing means.
            warnings.simplefilter("ignore", UserWarning)
            arriving.close()
        get_reusable_executor().shutdown(wait=True, kill_workers=True)
        raise


def _alone(trial: Trial, store: Store, measure: Measure) -> Outcome:
    for _ in range(ATTEMPTS):
        try:
            ((_, result, error, seconds),) = _parallel([trial], measure, 1, [])
        except TerminatedWorkerError as death:
            reason = str(death)
        else:
            return _keep(store, trial, result, error, seconds)
    return _keep(store, trial, None, f"its worker died {ATTEMPTS} times: {reason}", 0.0)


def _keep(
    store: Store, trial: Trial, result: TrialResult | None, error: str | None, seconds: float
) -> Outcome:
    with _undisturbed():
        if result is None:
            store.fail(trial, error or "")
        else:
            store.save(trial, result, seconds)
    return Outcome(trial, error, seconds)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Put off Ctrl-C until what is being kept is kept."""
    pressed: list[int] = []
    with _handling(lambda number, _: pressed.append(number)):
        yield
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def _deaf() -> Iterator[None]:
    """Ignore Ctrl-C, as the processes started meanwhile will do for ever: it is for the parent."""
    with _handling(signal.SIG_IGN):
        yield


@contextmanager
def _handling(handler: Any) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # Python tells the main thread only, and lets no other change that
        return
    usual = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
