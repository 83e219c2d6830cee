"""Worker processes of this machine, by joblib's loky."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from typing import Any

import joblib
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from ..trials.trial import Trial
from .interrupts import deaf
from .worker import Arrival, RunTrial, attempt, begin

QUIET = "ignore:resource_tracker:UserWarning"
"""The process that tidies up after a killed run would complain at length of what it tidies up."""


class LokyWorkers:
    """Processes of this machine, which end with their parent; see `Workers`.

    Workers are separate processes even for one job: a crash in native code costs one trial, and
    the number of threads that linear algebra uses is always one. When a worker dies, loky ends all
    others: the trials that were running then are all lost.

    Parameters
    ----------
    jobs
        Number of processes that are busy at a time.

    Raises
    ------
    ValueError
        If `jobs` is less than 1.
    """

    def __init__(self, jobs: int) -> None:
        if jobs < 1:
            raise ValueError(f"jobs = {jobs}: must be at least 1")
        self.processes = jobs
        filters = os.environ.get("PYTHONWARNINGS", "")
        if QUIET not in filters:  # processes that are started from here on inherit it
            os.environ["PYTHONWARNINGS"] = f"{filters},{QUIET}".lstrip(",")

    def arrivals(
        self, trials: Sequence[Trial], run_trial: RunTrial, started: Callable[[str], None]
    ) -> Generator[Arrival]:
        """See `Workers.arrivals`."""
        queue = list(trials)
        while queue:
            handed = _Handed(self.processes, started)
            try:
                with closing(self._parallel(queue, run_trial, handed.take)) as arriving:
                    for arrival in arriving:
                        handed.settle(arrival.trial)
                        yield arrival
            except TerminatedWorkerError as death:
                for trial in handed.running():
                    handed.settle(trial)
                    yield Arrival(trial, None, str(death), 0.0, lost=True)
            queue = [trial for trial in queue if trial.identity not in handed.settled]

    def _parallel(
        self, trials: Sequence[Trial], run_trial: RunTrial, take: Callable[[Trial], None]
    ) -> Generator[Arrival]:
        def tasks() -> Iterator[Any]:
            for trial in trials:
                take(trial)
                yield joblib.delayed(attempt)(run_trial, trial)

        worker = {"initializer": begin, "initargs": (os.getpid(),)}
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1, **worker):
            # joblib runs a single job in this process: ask for two workers and feed them singly.
            parallel = joblib.Parallel(
                n_jobs=max(self.processes, 2), pre_dispatch=self.processes, batch_size=1,
                return_as="generator_unordered",
            )  # fmt: skip
            with deaf():
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


class _Handed:
    """Tells what is running: joblib takes some trials from us before a worker is free."""

    def __init__(self, processes: int, started: Callable[[str], None]) -> None:
        self.settled: set[str] = set()
        self._processes, self._started = processes, started
        self._left: list[Trial] = []
        self._told: set[str] = set()
        self._changing = threading.Lock()

    def take(self, trial: Trial) -> None:
        with self._changing:
            self._left.append(trial)
            self._tell()

    def settle(self, trial: Trial) -> None:
        with self._changing:
            self.settled.add(trial.identity)
            self._left = [other for other in self._left if other.identity != trial.identity]
            self._tell()

    def running(self) -> list[Trial]:
        """Return the trials that workers have: they get them in the order of taking."""
        return self._left[: self._processes]

    def _tell(self) -> None:
        for trial in self.running():
            if trial.identity not in self._told:
                self._told.add(trial.identity)
                self._started(trial.identity)
