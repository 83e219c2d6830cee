"""Runs trials on workers of any kind and keeps every result the moment it arrives.

A trial whose worker died is run again when the others are done, alone, up to `ATTEMPTS` times.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from ..store.running import Running
from ..store.store import Store
from .arrivals import Workers
from .interrupts import undisturbed
from .worker import Outcome, RunTrial

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

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
