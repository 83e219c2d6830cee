"""Runs trials on workers of any kind and keeps every result the moment it arrives.

A trial whose worker died is run again when the others are done, alone, up to `ATTEMPTS` times. What
happens in a worker process stands here, too, so this is light to import: a worker must be up early.
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
from contextlib import closing, contextmanager
from itertools import chain, islice
from pathlib import Path
from platform import python_version
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Generic, Literal, NamedTuple, Protocol, Self, TypeVar

from ..store.store import Store
from ..store.writer import Running

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

ORPHANED = 0.5
"""How often a worker looks whether its parent is still there [s]."""

PACKAGES = ("nested-agents", "numpy", "numba", "scipy", "Box2D")
"""The packages on whose versions the bits of a result may depend."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""What tells linear algebra to use one thread: last bits depend on their number."""

MOST_ERROR = 20_000
"""Characters of a traceback that are kept; the middle of a longer one is left out."""

RunTrial = Callable[["Trial"], "TrialResult"]
"""Runs one trial; a module-level function, since workers import it by name."""


def cores() -> int:
    """Return how many cores this process may use."""
    from joblib import cpu_count

    return int(cpu_count())


class Outcome(NamedTuple):
    """What became of a trial."""

    trial: Trial
    error: str | None
    """Its traceback if it failed; how its worker died if it is `lost`."""
    seconds: float
    """How long it took."""
    result: TrialResult | None = None
    """What it measured, if it came to an end."""
    lost: bool = False
    """Whether its worker died while it ran: perhaps its fault, perhaps not."""


def begin(parent: int) -> None:
    """Do not outlive the process `parent`, even if it is killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(ORPHANED)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def attempt(run_trial: RunTrial, trial: Trial) -> Outcome:
    """Run one trial; what goes wrong is returned as text.

    A scenario that calls ``sys.exit``, or raises KeyboardInterrupt, has failed like any other: a
    worker ignores Ctrl-C, so that neither can come from anybody else.
    """
    begin = time.perf_counter()
    error = None
    result = None
    try:
        with trial.sources.active():
            result = run_trial(trial)
    except BaseException:
        error = storable(traceback.format_exc())
    return Outcome(trial, error, time.perf_counter() - begin, result)


def storable(error: str) -> str:
    r"""Return a traceback as text that any file can hold, shortened if it is very long.

    Examples
    --------
    >>> storable("ValueError: \ud800")
    'ValueError: \\ud800'
    >>> len(storable("x" * 3_000_000)) < MOST_ERROR + 100
    True
    """
    text = error.encode("utf-8", "backslashreplace").decode("utf-8")
    left_out = len(text) - MOST_ERROR
    if left_out <= 0:
        return text
    half = MOST_ERROR // 2
    return f"{text[:half]}\n[... {left_out} characters left out ...]\n{text[-half:]}"


def versions() -> dict[str, str]:
    """Return the versions of what a trial's bits may depend on, by name."""
    from ..store.database import RESULTS_VERSION

    packages = {name: installed(name) for name in PACKAGES}
    return {"results version": str(RESULTS_VERSION), "Python": python_version(), **packages}


def installed(package: str) -> str:
    """Return the version of a package. That of Box2D is its module's: several packages offer it."""
    if package == "Box2D":
        import Box2D

        return str(Box2D.__version__)
    from importlib.metadata import version

    return version(package)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Put off Ctrl-C until what is being kept is kept."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python tells the main thread only, and lets no other change that
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
def beginning_processes() -> Iterator[None]:
    """Put off Ctrl-C; the processes begun meanwhile never hear of it: it is for the parent."""
    from multiprocessing import resource_tracker  # takes its time

    resource_tracker.ensure_running()  # would unblock the signal when the first process begins
    if sys.platform == "win32":  # which blocks no signals
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
    trials: Sequence[Trial], store: Store, run_trial: RunTrial, workers: Workers[F]
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
        again = (_alone(trial, run_trial, workers, running) for trial in lost)
        arrivals = workers.arrivals(trials, run_trial, running.start, running.end)
        with closing(arrivals) as arriving:
            for outcome in chain(arriving, again):
                if outcome.lost:
                    lost.append(outcome.trial)
                else:
                    _keep(store, outcome)
                    yield outcome


def _alone(trial: Trial, run_trial: RunTrial, workers: Workers[F], running: Running) -> Outcome:
    for _ in range(ATTEMPTS):
        arrivals = workers.arrivals([trial], run_trial, running.start, running.end)
        with closing(arrivals) as arriving:
            (outcome,) = arriving
        if not outcome.lost:
            return outcome
    error = f"its worker died {ATTEMPTS} times: {outcome.error}"
    return outcome._replace(error=error, lost=False)


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
        trial.planned,
        episodes=[row.flat(names) for row in result.rows],
        seconds={**result.seconds, "total": total},
        numbers=numbers,
        recordings=result.recordings,
    )


POLL = 1.0
"""How often to look for workers while no trial finishes [s]."""


class Submitted(Protocol):
    """A trial that a worker has been handed: a future of a backend."""

    def add_done_callback(self, fn: Callable[[Self], object], /) -> object:
        """Call a function with it when it is done."""


F = TypeVar("F", bound=Submitted)


class Workers(ABC, Generic[F]):
    """Processes that run trials; what their backends have in common."""

    @property
    @abstractmethod
    def processes(self) -> int:
        """How many trials run at a time."""

    @abstractmethod
    def submit(self, run_trial: RunTrial, trial: Trial) -> F:
        """Hand a trial to a worker that is free, and return its future."""

    @abstractmethod
    def fetch(self, future: F, trial: Trial) -> Outcome | None:
        """Return what became of a trial whose future is done; None if it runs once more."""

    @abstractmethod
    def stop(self, futures: Sequence[F]) -> None:
        """End the trials that are running."""

    def arrivals(
        self,
        trials: Sequence[Trial],
        run_trial: RunTrial,
        started: Callable[[str], None],
        ended: Callable[[str], None],
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
        ended
            Called with it when the trial has come back, before a next one is handed out.
        """
        waiting = iter(trials)
        left = len(trials)
        running: dict[F, Trial] = {}
        finished: SimpleQueue[F] = SimpleQueue()

        def hand_out() -> None:
            for trial in islice(waiting, max(self.processes - len(running), 0)):
                with beginning_processes():
                    future = self.submit(run_trial, trial)
                    running[future] = trial
                started(trial.identity)
                future.add_done_callback(finished.put)

        try:
            while left:
                hand_out()
                try:
                    future = finished.get(timeout=POLL)
                except Empty:
                    continue
                outcome = self.fetch(future, running[future])
                if outcome is None:
                    future.add_done_callback(finished.put)
                    continue
                ended(running.pop(future).identity)
                del future  # else a Dask worker keeps its result, which is run again if it dies
                left -= 1
                hand_out()  # the worker goes on while this one is kept
                yield outcome
        finally:
            if running:
                self.stop(list(running))
