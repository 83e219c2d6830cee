"""Worker pools: processes on this machine, or workers of a Dask cluster.

All backends have one interface and give the same bits: linear algebra uses one thread, and a trial
that runs user files has its own process. Other trials may share a process, because built-in code
keeps no state.
"""

import os
import re
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from multiprocessing import get_context
from numbers import Integral
from typing import Any, get_args

from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from ...core.isolation import safe_path
from ...core.plugins.words import closest, expect
from ...core.shell import command_line
from ..errors import SpecError
from ..trials.trial import Trial
from .fork_server import Answer, call_for, describe_exit, outcome_of
from .runner import (
    ONE_THREAD,
    Backend,
    Outcome,
    RunTrial,
    Workers,
    attempt,
    cores,
    end_with_parent,
)


def check_jobs(jobs: int) -> None:
    """Raise if the number of processes is no whole number above 0."""
    expect("a whole number", Integral, jobs=jobs)
    if jobs < 1:
        raise SpecError(f"--jobs {jobs}: must be at least 1")


def check_workers(backend: Backend, jobs: int | None, address: str | None) -> None:
    """Raise if `start_workers` could not start, before anything is written."""
    if jobs is not None:
        check_jobs(jobs)
    if backend not in (known := get_args(Backend)):
        raise SpecError(f"backend = {backend!r}: {closest(backend, known)}")
    if backend == "loky" and address is not None:
        raise SpecError(f"--address {address}: is for --backend dask only")
    if address is None:
        _check_semaphores()


def _check_semaphores() -> None:
    """Raise if processes of this machine cannot share semaphores, which local workers need."""
    try:
        with safe_path():  # a semaphore starts a process that frees shared memory
            get_context("spawn").Semaphore()
    except (ImportError, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise SpecError(
            f"/dev/shm: {reason}: the processes that run trials need shared memory; mount it so "
            "that they can write to it, with 1 MB free"
        ) from None


@contextmanager
def start_workers(
    backend: Backend, jobs: int | None, address: str | None, trials: int
) -> Iterator[Workers]:
    """Start workers, which end with the context, or connect to a cluster.

    Parameters
    ----------
    backend
        Kind of workers.
    jobs
        Maximum number of trials at a time; None: one for each core or worker of the cluster, see
        also `ShortFirst`.
    address
        Address of the scheduler of a running Dask cluster; None: start workers on this machine.
    trials
        Number of trials, which also limits the number of workers.

    Raises
    ------
    SpecError
        If no workers can be started or reached, in one line.
    """
    check_workers(backend, jobs, address)
    wanted = max(1, min(jobs or cores(), trials))
    with safe_path():
        if backend == "loky":
            has_one_thread = os.environ.items() >= ONE_THREAD.items()
            yield (ShortFirst if jobs is None and has_one_thread else LokyWorkers)(wanted)
            return
        try:
            from .dask import DaskWorkers
        except ModuleNotFoundError as error:
            if error.name not in ("dask", "distributed"):
                raise
            install = command_line("install", "dask", "distributed", program="pip")
            raise SpecError(f"--backend dask: {error.name} is not installed; {install}") from None
        cluster = DaskWorkers.local(wanted) if address is None else DaskWorkers.at(address, jobs)
        with cluster as workers:
            yield workers


TRACKER_FILTER = "ignore:resource_tracker:UserWarning"
"""Filter for warnings of the process that frees resources after a killed run."""

REPLACED_WARNING = "A worker stopped while some jobs were given to the executor"
"""Warning of loky when it replaces a process that has grown by 300 MB, as with PyTorch."""

THREAD_VARIABLES = (
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
"""Environment variables that limit other libraries to one thread, besides `ONE_THREAD`."""

IDLE_TIMEOUT_S = 300
"""Time after which an idle process ends [s]."""

HAND_OVER_TIMEOUT_S = 2.0
"""Maximum time until a process receives a trial from loky and can be stopped [s]."""

EXIT_CODE = re.compile(r"\w+\((-?\d+)\)")
"""Finds the exit codes in a message of loky, such as ``SIGKILL(-9)``."""


def _describe(death: TerminatedWorkerError) -> str:
    """Return how workers ended, from a longer message of loky.

    Examples
    --------
    >>> _describe(TerminatedWorkerError("The exit codes of the workers are {EXIT(3), SIGABRT(-6)}"))
    'exit code 3, killed by SIGABRT'
    """
    codes = EXIT_CODE.findall(str(death).partition("exit codes of the workers are")[2])
    return ", ".join(describe_exit(int(code)) for code in codes) or "unknown exit code"


class LokyWorkers(Workers):
    """Processes of this machine, which end with their parent; see `Workers`.

    Even a single job has its own process, so a crash in native code costs one trial, and linear
    algebra uses one thread. When a worker dies, loky ends all others, so all running trials are
    lost. The process of a trial with user code is not a worker and dies alone.

    Parameters
    ----------
    jobs
        Number of processes, at least 1.
    """

    processes = 0

    def __init__(self, jobs: int) -> None:
        self.processes = jobs
        self._executor: Any = None
        warnings.filterwarnings("ignore", REPLACED_WARNING)
        filters = os.environ.get("PYTHONWARNINGS", "")
        if TRACKER_FILTER not in filters:  # later processes inherit it
            os.environ["PYTHONWARNINGS"] = f"{filters},{TRACKER_FILTER}".lstrip(",")

    def submit(self, run_trial: RunTrial, trial: Trial) -> Future[Outcome | Answer]:
        """Run a trial in a worker process, see `Workers.submit`."""
        self._executor = get_reusable_executor(  # a new one if a worker has died
            self.processes,
            timeout=IDLE_TIMEOUT_S,
            initializer=end_with_parent,
            initargs=(os.getpid(),),
            env=ONE_THREAD | dict.fromkeys(THREAD_VARIABLES, "1"),
        )
        future: Future[Outcome | Answer] = self._executor.submit(*call_for(run_trial, trial))
        return future

    def fetch(self, future: Future[Outcome | Answer], trial: Trial) -> Outcome:
        """Return the outcome of a trial, see `Workers.fetch`."""
        try:
            return outcome_of(future.result(), trial)
        except TerminatedWorkerError as death:
            return Outcome(trial, _describe(death), 0.0, lost=True)

    def stop(self, futures: Sequence[Future[Outcome | Answer]]) -> None:
        """Stop trials that are running, see `Workers.stop`."""
        until = time.monotonic() + HAND_OVER_TIMEOUT_S
        while any(not (f.running() or f.done()) for f in futures) and time.monotonic() < until:
            time.sleep(0.01)  # otherwise a thread of loky ends with a traceback
        self._executor.shutdown(wait=True, kill_workers=True)


HERE_S = 2.0
"""Processor time for which `ShortFirst` runs trials before it starts workers [s]."""

MAX_SHORT_DECISIONS = 5_000
"""Maximum number of decisions of all agents in a short trial."""


class ShortFirst(LokyWorkers):
    """Workers that start after this process itself has run short trials for two seconds.

    Starting workers takes longer than running a few short trials.

    Parameters
    ----------
    jobs
        Number of processes, at least 1.
    """

    def __init__(self, jobs: int) -> None:
        super().__init__(jobs)
        self._until = time.process_time() + HERE_S

    def arrivals(
        self,
        trials: Sequence[Trial],
        run_trial: RunTrial,
        started: Callable[[str], None],
        ended: Callable[[str], None],
    ) -> Generator[Outcome]:
        """Run trials and yield their outcomes, see `Workers.arrivals`."""
        left = deque(trials)
        while left and time.process_time() < self._until and _is_short(left[0]):
            trial = left.popleft()
            started(trial.identity)
            outcome = attempt(run_trial, trial, Exception)  # Ctrl-C interrupts the study
            ended(trial.identity)
            yield outcome
        yield from super().arrivals(left, run_trial, started, ended)


def _is_short(trial: Trial) -> bool:
    """Return whether a trial takes well below a second and runs no user code."""
    if trial.sources.runs_foreign_code:
        return False
    return trial.max_steps * len(trial.world().agents) <= MAX_SHORT_DECISIONS
