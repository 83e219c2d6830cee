"""Running a study: all trials that are missing in its store, on workers of any kind.

An `Observer` receives the progress.
"""

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from math import inf
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
from ..store.store import Store
from ..trials.arrangement import check_conditions
from ..trials.checkpoints import remove_damaged
from ..trials.keeping import open_to_run, pending
from ..trials.trial import Trial, trials_of
from ..workers.runner import Backend, Observer, Outcome, run_trials, versions
from ..workers.workers import check_workers, start_workers
from .data import Place
from .study import StudyResults

CHECKPOINT = 300.0
"""Default interval between checkpoints of a trial [s]."""


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
    checkpoint: float = CHECKPOINT,
) -> Iterator[Store]:
    """Run the missing trials of a study; then its store is open until the context ends.

    Parameters
    ----------
    spec
        The study.
    directory
        Folder of the study; created if it does not exist.
    jobs, backend, address
        Kind and number of workers, see `start_workers`.
    retry_failed
        Whether failed trials are run again.
    accept_code
        Whether to continue a study although the installed code has changed.
    observer
        Object that is notified of progress; None for no notifications.
    chosen
        Trials to run. By default, all.
    checkpoint
        Interval between checkpoints of a trial, from which a killed trial resumes [s]; 0 for no
        checkpoints.

    Yields
    ------
    Store
        Contains the results of every trial, or its traceback (`Store.failed`).

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    KeyboardInterrupt
        If it is interrupted. Finished trials are kept, and the same call continues.
    """
    observer = observer or Observer()
    measures = examine(spec, may_fail=True)
    trials = chosen or trials_of(spec)
    check_workers(backend, jobs, address)
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
            kept = _checkpoints(store, checkpoint, observer)
            spec.sources.checkpoints = stack.enter_context(kept)
        left = pending(store, trials)
        # A user's study is made again in every worker, which knows its file.
        with spec.sources.active():
            is_own = is_reference(spec.study)
            run_one = measure_by_name if is_own else load_study(spec.study).measure
        for note in (*store.notes, *spec.warnings()):
            observer.note(note)
        outcomes: Iterator[Outcome] = iter(())
        if left:
            workers = workers or stack.enter_context(start(len(left)))
            observer.announce(spec, directory, workers.processes)
            if not workers.processes:
                observer.note("there is no worker yet: waiting for one")
            outcomes = stack.enter_context(closing(run_trials(left, store, run_one, workers)))
        try:
            observer.follow(outcomes, len(trials), len(trials) - len(left))
        except KeyboardInterrupt:
            observer.note(
                f"interrupted: {store.counts()['done']} of {len(trials)} trials are kept in "
                f"{directory}; the same command continues"
            )
            raise
        yield store


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
        yield Checkpoints(folder, seconds, code)
    finally:
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
) -> StudyResults:
    """Run the missing trials of a study and return all results; the same call resumes the study.

    Parameters
    ----------
    spec
        A `Spec`, a table as in TOML, which may hold objects, or the path of a TOML file.
    out
        Folder of the study; created if it does not exist. Every trial is stored as soon as it
        finishes.
    jobs, backend, address, retry_failed, accept_code, checkpoint
        As in `run_study`.
    progress
        Whether to show progress in the terminal.
    observer
        Receives the progress instead, see `nested_agents.studies.workers.runner.Observer`.

    Warns
    -----
    UserWarning
        If trials failed; ``study.failed`` has their tracebacks.

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    """
    expect("the path of a folder", str | PathLike, out=out)
    out = Path(out)
    spec = Spec.read(spec, study=out)
    listener = observer or (Terminal() if progress else Observer())
    with run_study(
        spec,
        out,
        jobs=jobs,
        backend=backend,
        address=address,
        retry_failed=retry_failed,
        accept_code=accept_code,
        observer=listener,
        checkpoint=checkpoint,
    ) as store:
        study = StudyResults.of(store)
    if study.failed and observer is None:
        warnings.warn(
            f"{count(len(study.failed), 'trial')} failed: study.failed says why", stacklevel=2
        )
    return study
