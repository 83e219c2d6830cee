"""Running trials on workers and storing each result when it arrives.

If a worker dies, its trial runs again after the others, alone, up to `ATTEMPTS` times. Worker
processes import this module, so it imports little.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from itertools import chain, islice
from pathlib import Path
from platform import python_version
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

from ..store.store import Store
from ..store.writer import Running

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

PARENT_POLL_S = 0.5
"""Polling interval of a worker for the end of its parent [s]."""

PACKAGES = ("nested-agents", "numpy", "numba", "scipy", "Box2D")
"""Packages with versions that may affect the bits of a result."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment variables for one thread of linear algebra, because bits depend on the number."""

MAX_ERROR_LENGTH = 20_000
"""Maximum length of a stored traceback; the middle of a longer one is left out [characters]."""

RunTrial = Callable[["Trial"], "TrialResult"]
"""Module-level function that runs one trial. Workers import it by name."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    from joblib import cpu_count

    return int(cpu_count())


class Outcome(NamedTuple):
    """Outcome of a trial."""

    trial: Trial
    error: str | None
    """Traceback if the trial failed; cause of death of the worker if it is `lost`."""
    seconds: float
    """Duration [s]."""
    result: TrialResult | None = None
    """Result if the trial finished."""
    lost: bool = False
    """Whether its worker died, which may have other causes than the trial."""


def end_with_parent(parent: int) -> None:
    """End this process when the process `parent` ends, even if that is killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_POLL_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def attempt(
    run_trial: RunTrial, trial: Trial, failure: type[BaseException] = BaseException
) -> Outcome:
    """Run one trial and return its result or its traceback.

    SystemExit and KeyboardInterrupt are failures of the trial, too, because workers ignore Ctrl-C.
    Exceptions that are no `failure` are raised.
    """
    from ...core.numerics import working_seconds  # status does without NumPy

    start = working_seconds()
    error = None
    result = None
    try:
        with trial.sources.active():
            result = run_trial(trial)
    except failure:
        error = storable(traceback.format_exc())
    return Outcome(trial, error, working_seconds() - start, result)


def storable(error: str) -> str:
    r"""Return a traceback as valid UTF-8, shortened to about `MAX_ERROR_LENGTH`.

    Examples
    --------
    >>> storable("ValueError: \ud800")
    'ValueError: \\ud800'
    >>> len(storable("x" * 3_000_000)) < MAX_ERROR_LENGTH + 100
    True
    """
    text = error.encode("utf-8", "backslashreplace").decode("utf-8")
    left_out = len(text) - MAX_ERROR_LENGTH
    if left_out <= 0:
        return text
    half = MAX_ERROR_LENGTH // 2
    return f"{text[:half]}\n[... {left_out} characters left out ...]\n{text[-half:]}"


def versions() -> dict[str, str]:
    """Return the versions that may affect the bits of a trial, by name."""
    from ..store.database import RESULTS_VERSION

    packages = {name: installed(name) for name in PACKAGES}
    return {"results version": str(RESULTS_VERSION), "Python": python_version(), **packages}


def installed(package: str) -> str:
    """Return the version of a package; two packages contain the module Box2D."""
    from importlib.metadata import PackageNotFoundError, version

    if package == "Box2D":
        with suppress(PackageNotFoundError):
            return version("box2d-py")
        package = "box2d"
    return version(package)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Delay Ctrl-C until the end of the context."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread receives signals
        return
    pressed: list[int] = []
    usual = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def starting_processes() -> Iterator[None]:
    """Delay Ctrl-C, and start processes that ignore it, because the parent handles it."""
    from multiprocessing import resource_tracker  # slow to import

    resource_tracker.ensure_running()  # it would unblock the signal when the first process starts
    if sys.platform == "win32":  # Windows cannot block signals
        with undisturbed():
            yield
        return
    with undisturbed():
        usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, usual)


Backend = Literal["loky", "dask"]
"""``loky``: processes of this machine. ``dask``: workers of a Dask cluster."""
ATTEMPTS = 2
"""Number of further attempts for a trial after its worker has died."""


class Observer:
    """Receives the progress of a study. This base class shows nothing."""

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """Show the study before its trials run."""

    def note(self, line: str) -> None:
        """Show a remark of one line."""

    def follow(self, outcomes: Iterable[Outcome], total: int, done: int) -> None:
        """Iterate over the outcomes, which runs the trials; `done` of `total` were run before."""
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
        Store of results and tracebacks.
    run_trial
        Module-level function that runs one trial.
    workers
        Workers that run the trials.
    """
    lost: list[Trial] = []
    with Running(store.directory, workers.processes) as running:
        again = (_alone(trial, run_trial, workers, running) for trial in lost)
        arrivals = workers.arrivals(trials, run_trial, running.start, running.end)
        with closing(arrivals) as arriving:
            for outcome in chain(arriving, again):
                if outcome.lost:
                    lost.append(outcome.trial)
                else:
                    _store_outcome(store, outcome)
                    yield outcome


def _alone(trial: Trial, run_trial: RunTrial, workers: Workers, running: Running) -> Outcome:
    for _ in range(ATTEMPTS):
        arrivals = workers.arrivals([trial], run_trial, running.start, running.end)
        with closing(arrivals) as arriving:
            (outcome,) = arriving
        if not outcome.lost:
            return outcome
    error = f"its worker died {ATTEMPTS} times: {outcome.error}"
    return outcome._replace(error=error, lost=False)


def _store_outcome(store: Store, outcome: Outcome) -> None:
    with undisturbed():
        if outcome.result is None:
            store.fail(outcome.trial.planned, outcome.error or "")
        else:
            save(store, outcome.trial, outcome.result, outcome.seconds)


def save(store: Store, trial: Trial, result: TrialResult, total: float) -> None:
    """Store the result of a trial that took `total` seconds. It is durable on return.

    Raises
    ------
    ValueError
        If the study does not have one of its measures.
    """
    names = [measure.name for measure in store.measures()]
    if unknown := {measure.name for measure in result.measures} - set(names):
        raise ValueError(f"measures {sorted(unknown)}: the study has {names}")
    numbers = [(name, value, True) for name, value in result.numbers.items()]
    numbers += [(name, value, False) for name, value in result.usage.items()]
    store.save(
        trial.planned,
        episodes=[row.flat(names) for row in result.rows],
        seconds={**result.seconds, "total": total},
        numbers=numbers,
        recordings=result.recordings,
    )


POLL_S = 1.0
"""Polling interval for new workers [s]."""


Submitted: TypeAlias = Any
"""Future of a backend, which has `add_done_callback`."""


class Workers(ABC):
    """Processes that run trials; base class of the backends."""

    @property
    @abstractmethod
    def processes(self) -> int:
        """Number of trials that run at a time."""

    @abstractmethod
    def submit(self, run_trial: RunTrial, trial: Trial) -> Submitted:
        """Submit a trial to a free worker and return its future."""

    @abstractmethod
    def fetch(self, future: Submitted, trial: Trial) -> Outcome | None:
        """Return the outcome of a trial after its future is done; None if it runs again."""

    @abstractmethod
    def stop(self, futures: Sequence[Submitted]) -> None:
        """Stop the running trials."""

    def arrivals(
        self,
        trials: Sequence[Trial],
        run_trial: RunTrial,
        started: Callable[[str], None],
        ended: Callable[[str], None],
    ) -> Generator[Outcome]:
        """Run trials and yield their outcomes as they arrive. Closing the generator stops them.

        Parameters
        ----------
        trials
            The trials.
        run_trial
            Module-level function that runs one trial.
        started
            Called with the identity of a trial when it is submitted.
        ended
            Called with the identity of a trial when it has ended, before the next is submitted.
        """
        waiting = iter(trials)
        left = len(trials)
        running: dict[Submitted, Trial] = {}
        finished: SimpleQueue[Submitted] = SimpleQueue()

        def submit_waiting() -> None:
            for trial in islice(waiting, max(self.processes - len(running), 0)):
                with starting_processes():
                    future = self.submit(run_trial, trial)
                    running[future] = trial
                started(trial.identity)
                future.add_done_callback(finished.put)

        try:
            while left:
                submit_waiting()
                try:
                    future = finished.get(timeout=POLL_S)
                except Empty:
                    continue
                outcome = self.fetch(future, running[future])
                if outcome is None:
                    future.add_done_callback(finished.put)
                    continue
                ended(running.pop(future).identity)
                # Otherwise Dask keeps the result and runs the trial again if the worker dies.
                del future
                left -= 1
                submit_waiting()  # the worker continues while the outcome is stored
                yield outcome
        finally:
            if running:
                self.stop(list(running))
