"""Hands trials to workers, and yields what becomes of them as it arrives.

joblib has a backend for Dask, too. It ends all trials when one kills its worker, and counts the
workers once, when a run begins: hence this loop, which both backends share.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from itertools import islice
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from .interrupts import ignore_interrupts
from .worker import Outcome, RunTrial

if TYPE_CHECKING:
    from ..trials.trial import Trial

POLL = 1.0
"""How often to look for workers while no trial finishes [s]."""


class Workers(ABC):
    """Processes that run trials; what their backends have in common."""

    @property
    @abstractmethod
    def processes(self) -> int:
        """How many trials run at a time."""

    @abstractmethod
    def submit(self, run_trial: RunTrial, trial: Trial) -> Any:
        """Hand a trial to a worker that is free, and return its future."""

    @abstractmethod
    def fetch(self, future: Any, trial: Trial) -> Outcome | None:
        """Return what became of a trial whose future is done; None if it runs once more."""

    @abstractmethod
    def stop(self, futures: Sequence[Any]) -> None:
        """End the trials that are running."""

    def arrivals(
        self, trials: Sequence[Trial], run_trial: RunTrial, started: Callable[[str], None]
    ) -> Generator[Outcome]:
        """Run trials and yield what becomes of each, in whatever order; closing stops them.

        Parameters
        ----------
        trials
            The trials.
        run_trial
            Runs one of them; a module-level function, since workers import it by name.
        started
            Called with the identity of each trial when it is handed to a worker.
        """
        waiting, left = iter(trials), len(trials)
        running: dict[Any, Trial] = {}
        finished: SimpleQueue[Any] = SimpleQueue()
        try:
            while left:
                for trial in islice(waiting, max(self.processes - len(running), 0)):
                    with ignore_interrupts():
                        future = self.submit(run_trial, trial)
                    running[future] = trial
                    started(trial.identity)
                    future.add_done_callback(finished.put)
                try:
                    future = finished.get(timeout=POLL)
                except Empty:
                    continue
                outcome = self.fetch(future, running[future])
                if outcome is None:
                    future.add_done_callback(finished.put)
                    continue
                del running[future]
                left -= 1
                yield outcome
        finally:
            if running:
                self.stop(list(running))
