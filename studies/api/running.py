"""Running a study: all trials that are missing in its store, on workers of any kind.

An `Observer` receives the progress.
"""

import json
import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from math import inf
from numbers import Real
from os import PathLike
from pathlib import Path

from ...core.interface.measures import Measure
from ...core.plugins.sources import Checkpoints, is_reference
from ...core.plugins.words import expect
from ..catalogue.study import load_study, measure_by_name
from ..errors import SpecError
from ..presentation.progress import Terminal, count
from ..spec.spec import Spec
from ..store.database import CHECKPOINTS
from ..store.durable import remove_incomplete
from ..store.store import Store
from ..trials.arrangement import check_conditions
from ..trials.checkpoints import remove_damaged
from ..trials.keeping import open_to_run, pending
from ..trials.trial import trials_of
from ..workers.runner import Backend, Observer, Outcome, RunTrial, run_trials, versions
from ..workers.workers import check_workers, start_workers
from .data import Place
from .study import StudyResults

CHECKPOINT = 300.0
"""Default interval between checkpoints of a trial [s]."""


def folder(out: Place) -> Path:
    """Return the folder of a study that is to be written.

    Raises
    ------
    ValueError
        If it is not a path, or an empty one, which would be the current folder; one line.
    """
    allowed = "the path of a folder, '.' for the current one"
    expect(allowed, str | PathLike, out=out)
    if not str(out):
        raise ValueError(f"out = '', allowed: {allowed}")
    return Path(out)


@contextmanager
def _checkpoints(store: Store, seconds: float, observer: Observer) -> Iterator[Checkpoints]:
    """Create the folder of checkpoints; remove it on exit if it is empty."""
    folder = store.directory.resolve() / CHECKPOINTS
    with suppress(OSError):  # trials go on without
        folder.mkdir(exist_ok=True)
        for remark in remove_damaged(folder):
            observer.note(remark)
    code = json.dumps([store.code_digest, versions()])
    try:
        yield folder, seconds, code
    finally:
        remove_incomplete(folder)  # of killed workers
        with suppress(OSError):
            folder.rmdir()


def examine(spec: Spec, *, may_fail: bool = False) -> tuple[Measure, ...]:
    """Return the measures of the episodes of a study that can run; see `check_conditions`.

    Raises
    ------
    SpecError
        If a condition cannot be built, or the spec lacks something that the study needs. Nothing
        has been run or written then.
    """
    measures = check_conditions(spec, may_fail=may_fail)
    with spec.sources.active():
        load_study(spec.study).check(spec)
    return measures


def run(
    spec: Spec | Mapping[str, object] | Place,
    out: Place,
    *,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    retry_failed: bool = False,
    accept_code: bool = False,
    progress: bool = True,
    observer: Observer | None = None,
    checkpoint: float = CHECKPOINT,
    chosen: Collection[str] = (),
) -> StudyResults:
    """Run the missing trials of a study and return all results; the same call resumes the study.

    Parameters
    ----------
    spec
        A `Spec`, a table as in TOML, which may hold objects, or the path of a TOML file.
    out
        Folder of the study; created if it does not exist. Every trial is stored as soon as it
        finishes.
    jobs, backend, address
        Kind and number of workers, see `start_workers`.
    retry_failed
        Whether failed trials are run again.
    accept_code
        Whether to continue a study although the installed code has changed.
    progress
        Whether to show progress in the terminal.
    observer
        Receives the progress instead, see `nested_agents.studies.workers.runner.Observer`.
    checkpoint
        Interval between checkpoints of a trial, from which a killed trial resumes [s]; 0 for no
        checkpoints.
    chosen
        Identities of the trials to run. By default, all.

    Warns
    -----
    UserWarning
        If trials failed; ``study.failed`` has their tracebacks.

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    KeyboardInterrupt
        If it is interrupted. Finished trials are kept, and the same call continues.
    """
    directory = folder(out)
    spec = Spec.read(spec, study=directory)
    listener = observer or (Terminal() if progress else Observer())
    measures = examine(spec, may_fail=True)
    trials = [t for t in trials_of(spec) if not chosen or t.identity in chosen]
    check_workers(backend, jobs, address)
    expect("a number of seconds", Real, checkpoint=checkpoint)
    if not 0.0 <= checkpoint < inf:
        raise SpecError(f"--checkpoint {checkpoint:g}: must be 0 or more seconds")
    with ExitStack() as stack:
        start = partial(start_workers, backend, jobs, address)
        # A cluster that cannot be reached is reported before anything is written.
        workers = None if address is None else stack.enter_context(start(len(trials)))
        opened = open_to_run(directory, spec, trials, measures, accept_code=accept_code)
        store = stack.enter_context(opened)
        if retry_failed:
            store.forget_failed()
        if checkpoint:
            kept = _checkpoints(store, checkpoint, listener)
            spec.sources.checkpoints = stack.enter_context(kept)
        left = pending(store, trials)
        for note in (*store.notes, *spec.warnings()):
            listener.note(note)
        outcomes: Iterator[Outcome] = iter(())
        if left:
            workers = workers or stack.enter_context(start(len(left)))
            listener.announce(spec, directory, workers.processes)
            if not workers.processes:
                listener.note("there is no worker yet: waiting for one")
            arriving = run_trials(left, store, _measure_of(spec), workers)
            outcomes = stack.enter_context(closing(arriving))
        try:
            listener.follow(outcomes, len(trials), len(trials) - len(left))
        except KeyboardInterrupt:
            listener.note(
                f"interrupted: {store.counts()['done']} of {len(trials)} trials are kept in "
                f"{directory}; the same command continues"
            )
            raise
        study = StudyResults.of(store)
    if study.failed and observer is None:
        warnings.warn(
            f"{count(len(study.failed), 'trial')} failed: study.failed says why", stacklevel=2
        )
    return study


def _measure_of(spec: Spec) -> RunTrial:
    """Return the function that runs a trial; workers make a user's study again."""
    with spec.sources.active():
        return measure_by_name if is_reference(spec.study) else load_study(spec.study).measure
