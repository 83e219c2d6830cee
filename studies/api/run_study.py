"""Runs a study: every trial that its store does not hold yet, on workers of any kind.

Nothing is printed here: who wants to see how it goes passes an `Observer`.
"""

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from ...core.interface.scenario import Measure
from ...core.plugins.sources import is_reference
from ..catalogue.study import load_study, measured
from ..spec.spec import Spec
from ..store.store import Store
from ..trials.keeping import open_to_run, pending
from ..trials.session import check
from ..trials.trial import Trial, trials_of
from ..workers.runner import Backend, Observer, RunTrial, run_trials
from ..workers.workers import start_workers


@contextmanager
def run_study(
    spec: Spec,
    directory: Path,
    *,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    retry_failed: bool = False,
    accept_code: bool = False,
    observer: Observer | None = None,
    chosen: Sequence[Trial] = (),
    title: str = "",
) -> Iterator[Store]:
    """Run what is left of a study; then its store is open for as long as the context lasts.

    Parameters
    ----------
    spec
        The study.
    directory
        Where it is kept; made if it does not exist.
    jobs, backend, address
        Who runs the trials, see `start_workers`.
    retry_failed
        Whether failed trials are run again.
    accept_code
        Whether to go on with a study although the installed code has changed.
    observer
        Who is notified of progress; None: nobody.
    chosen
        Those of its trials that are run; none named: all.
    title
        What is noted first, once nothing is refused any more; empty: nothing.

    Yields
    ------
    Store
        With the results of every trial, or its traceback (`Store.failed`).

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    KeyboardInterrupt
        If it is interrupted. What has finished is kept; the same call continues.
    """
    observer = observer or Observer()
    measures, trials = examine(spec), chosen or trials_of(spec)
    with (
        start_workers(backend, jobs, address, len(trials)) as workers,
        open_to_run(directory, spec, trials, measures, accept_code=accept_code) as store,
    ):
        if retry_failed:
            store.forget_failed()
        left = pending(store, trials)
        for note in filter(None, (title, *store.notes, *spec.warnings())):
            observer.note(note)
        if left:
            observer.announce(spec, directory, workers.processes)
        if left and not workers.processes:
            observer.note("there is no worker yet: waiting for one")
        try:
            with closing(run_trials(left, store, _run_trial(spec), workers)) as outcomes:
                observer.follow(outcomes, len(trials), len(trials) - len(left))
        except KeyboardInterrupt:
            observer.note(
                f"interrupted: {store.counts()['done']} of {len(trials)} trials are kept in "
                f"{directory}; the same command continues"
            )
            raise
        yield store


def examine(spec: Spec) -> tuple[Measure, ...]:
    """Return what a study measures of its episodes, if it can be run.

    Raises
    ------
    SpecError
        If a condition cannot be built, or the study has not what it needs; before anything is run
        or written.
    """
    measures = check(spec)
    with spec.sources.active():
        getattr(load_study(spec.study), "check", lambda spec: None)(spec)
    return measures


def _run_trial(spec: Spec) -> RunTrial:
    """Return what runs a trial of the study."""
    if is_reference(spec.study):  # made again in every worker, which knows the file
        return measured
    return load_study(spec.study).measure
