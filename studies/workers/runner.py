"""Runs trials on workers of any kind and keeps every result the moment it arrives.

A trial whose worker died is run again when the others are done, alone, up to `ATTEMPTS` times.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Literal

from ..store.store import Running, Store
from .worker import Outcome, RunTrial, ignore_interrupts, undisturbed

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

Backend = Literal["loky", "dask"]
"""``loky``: processes of this machine. ``dask``: workers of a Dask cluster."""
ATTEMPTS = 2
"""How often a trial is run alone whose worker has died."""


class Observer:
    """Is notified of a study's progress; this one does nothing with it."""

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """Learn what is about to be run, if anything is left to run."""

    def note(self, line: str) -> None:
        """Learn of something out of the ordinary, in one line."""

    def follow(self, outcomes: Iterable[Outcome], total: int, done: int) -> None:
        """Consume the outcomes, which runs the trials; `done` of `total` were run before."""
        for _ in outcomes:
            pass


def run_trials(
    trials: Sequence[Trial], store: Store, run_trial: RunTrial, workers: Workers
) -> Generator[Outcome]:
    """Run trials in parallel; store, then yield each as it finishes.

    Closing the generator, or an exception in its consumer, stops the workers at once.

    Parameters
    ----------
    trials
        The trials to run, for instance those that are `pending`.
    store
        Where results and tracebacks are kept.
    run_trial
        Runs one trial; a module-level function, since workers import it by name.
    workers
        Who runs them.
    """
    lost: list[Trial] = []
    with Running(store.directory, workers.processes) as running:
        with closing(workers.arrivals(trials, run_trial, running.begin)) as arriving:
            for outcome in arriving:
                running.end(outcome.trial.identity)
                if outcome.lost:
                    lost.append(outcome.trial)
                else:
                    _keep(store, outcome)
                    yield outcome
        for trial in lost:
            outcome = _alone(trial, run_trial, workers, running)
            running.end(trial.identity)
            _keep(store, outcome)
            yield outcome


def _alone(trial: Trial, run_trial: RunTrial, workers: Workers, running: Running) -> Outcome:
    for _ in range(ATTEMPTS):
        with closing(workers.arrivals([trial], run_trial, running.begin)) as arriving:
            (outcome,) = arriving
        if not outcome.lost:
            return outcome
    return outcome._replace(error=f"its worker died {ATTEMPTS} times: {outcome.error}")


def _keep(store: Store, outcome: Outcome) -> None:
    with undisturbed():
        if outcome.result is None:
            store.fail(outcome.trial.planned, outcome.error or "")
        else:
            save(store, outcome.trial, outcome.result, outcome.seconds)


def save(store: Store, trial: Trial, result: TrialResult, total: float) -> None:
    """Keep the result of a trial that took `total` seconds; durable on return.

    Raises
    ------
    ValueError
        If it has a measure that the study has not.
    """
    names = [measure.name for measure in store.measures()]
    if unknown := {measure.name for measure in result.measures} - set(names):
        raise ValueError(f"measures {sorted(unknown)}: the study has {names}")
    numbers = [(name, value, True) for name, value in result.numbers.items()]
    numbers += [(name, value, False) for name, value in result.usage.items()]
    store.save(
        trial.planned, [row.flat(names) for row in result.rows],
        {**result.seconds, "total": total}, numbers, result.recordings,
    )  # fmt: skip


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
