"""Worker processes of this machine, by joblib's loky."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from typing import Any

import joblib
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from .interrupts import deaf
from .trial import Trial
from .worker import Arrival, Measure, attempt, begin


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

    def arrivals(
        self, trials: Sequence[Trial], measure: Measure, started: Callable[[Trial], None]
    ) -> Generator[Arrival]:
        """See `Workers.arrivals`."""
        queue = list(trials)
        while queue:
            running: dict[str, Trial] = {}
            settled: set[str] = set()

            def note(trial: Trial, running: dict[str, Trial] = running) -> None:
                running[trial.identity] = trial
                started(trial)

            try:
                with closing(self._parallel(queue, measure, note)) as arriving:
                    for arrival in arriving:
                        settled.add(arrival.trial.identity)
                        yield arrival
            except TerminatedWorkerError as death:
                for identity in running.keys() - settled:
                    settled.add(identity)
                    yield Arrival(running[identity], None, str(death), 0.0, lost=True)
            queue = [trial for trial in queue if trial.identity not in settled]

    def _parallel(
        self, trials: Sequence[Trial], measure: Measure, started: Callable[[Trial], None]
    ) -> Generator[Arrival]:
        def tasks() -> Iterator[Any]:
            for trial in trials:
                started(trial)
                yield joblib.delayed(attempt)(measure, trial)

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
