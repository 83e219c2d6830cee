"""Runs trials on workers of any kind and keeps every result the moment it arrives.

A trial whose worker died is run again when the others are done, alone, up to `ATTEMPTS` times.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..store.running import Running
from ..store.store import Store
from .arrivals import Workers
from .interrupts import undisturbed
from .worker import Arrival, RunTrial

if TYPE_CHECKING:
    from ..trials.trial import Trial, TrialResult

ATTEMPTS = 2
"""How often a trial is run alone whose worker has died."""


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
    result
        What it measured, if it did not fail.
    """

    trial: Trial
    error: str | None
    seconds: float
    result: TrialResult | None = None


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
            for arrival in arriving:
                running.end(arrival.trial.identity)
                if arrival.lost:
                    lost.append(arrival.trial)
                else:
                    yield _keep(store, arrival)
        for trial in lost:
            arrival = _alone(trial, run_trial, workers, running)
            running.end(trial.identity)
            yield _keep(store, arrival)


def _alone(trial: Trial, run_trial: RunTrial, workers: Workers, running: Running) -> Arrival:
    for _ in range(ATTEMPTS):
        with closing(workers.arrivals([trial], run_trial, running.begin)) as arriving:
            (arrival,) = arriving
        if not arrival.lost:
            return arrival
    return arrival._replace(error=f"its worker died {ATTEMPTS} times: {arrival.error}")


def _keep(store: Store, arrival: Arrival) -> Outcome:
    with undisturbed():
        if arrival.result is None:
            store.fail(arrival.trial.planned, arrival.error or "")
        else:
            save(store, arrival.trial, arrival.result, arrival.seconds)
    return Outcome(arrival.trial, arrival.error, arrival.seconds, arrival.result)


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
