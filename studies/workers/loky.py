"""Worker processes of this machine, by joblib's loky."""

import os
import time
from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from ..trials.trial import Trial
from .arrivals import Workers
from .worker import ONE_THREAD, Outcome, RunTrial, attempt, begin

QUIET = "ignore:resource_tracker:UserWarning"
"""The process that tidies up after a killed run would complain at length of what it tidies up."""

THREADS = ("BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS")
"""What tells other libraries to use one thread, beside `ONE_THREAD`."""

IDLE = 300
"""How long a process without a trial is kept [s]."""

HANDED_ON = 2.0
"""How long loky may take to hand a trial on to a process [s]; until then it cannot stop it."""


class LokyWorkers(Workers):
    """Processes of this machine, which end with their parent; see `Workers`.

    Workers are separate processes even for one job: a crash in native code costs one trial, and
    the number of threads that linear algebra uses is always one. When a worker dies, loky ends all
    others: the trials that were running then are all lost.

    Parameters
    ----------
    jobs
        Number of processes that are busy at a time, at least 1.
    """

    processes = 0

    def __init__(self, jobs: int) -> None:
        self.processes = jobs
        self._executor: Any = None
        filters = os.environ.get("PYTHONWARNINGS", "")
        if QUIET not in filters:  # processes that are started from here on inherit it
            os.environ["PYTHONWARNINGS"] = f"{filters},{QUIET}".lstrip(",")

    def submit(self, run_trial: RunTrial, trial: Trial) -> Future[Outcome]:
        """See `Workers.submit`."""
        self._executor = get_reusable_executor(  # another one, if a worker has died
            self.processes, timeout=IDLE, initializer=begin, initargs=(os.getpid(),),
            env=ONE_THREAD | dict.fromkeys(THREADS, "1"),
        )  # fmt: skip
        future: Future[Outcome] = self._executor.submit(attempt, run_trial, trial)
        return future

    def fetch(self, future: Future[Outcome], trial: Trial) -> Outcome:
        """See `Workers.fetch`."""
        try:
            return future.result()
        except TerminatedWorkerError as death:
            return Outcome(trial, str(death), 0.0, lost=True)

    def stop(self, futures: Sequence[Future[Outcome]]) -> None:
        """See `Workers.stop`."""
        until = time.monotonic() + HANDED_ON
        while any(not (f.running() or f.done()) for f in futures) and time.monotonic() < until:
            time.sleep(0.01)  # its thread would end with a traceback
        self._executor.shutdown(wait=True, kill_workers=True)
