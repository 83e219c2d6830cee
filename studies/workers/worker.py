"""What happens in a worker process. Light to import: a worker must be up early."""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from platform import python_version
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from ..trials.trial import Trial, TrialResult

POLL = 0.5
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


class UnlikeWorkerError(Exception):
    """A worker on which a trial might give other bits, or could not run; one line."""


def begin(parent: int) -> None:
    """Do not outlive the process `parent`, even if it is killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def attempt(run_trial: RunTrial, trial: Trial) -> Outcome:
    """Run one trial; what goes wrong is returned as text.

    A scenario that calls ``sys.exit``, or raises KeyboardInterrupt, has failed like any other: a
    worker ignores Ctrl-C, so that neither can come from anybody else.
    """
    begin = time.perf_counter()
    try:
        with trial.sources.active():
            result = run_trial(trial)
    except BaseException:
        error = storable(traceback.format_exc())
        return Outcome(trial, error, time.perf_counter() - begin)
    return Outcome(trial, None, time.perf_counter() - begin, result)


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


def attempt_alike(expected: dict[str, str], run_trial: RunTrial, trial: Trial) -> Outcome:
    """Run one trial on a worker that somebody else started, if it is as `expected`.

    Raises
    ------
    UnlikeWorkerError
        If its versions are not the `expected` ones, see `versions`, or it uses several threads.
    """
    from distributed import get_worker

    worker = get_worker()
    here = versions() | {name: os.environ.get(name, "not set") for name in ONE_THREAD}
    for name, wanted in (expected | ONE_THREAD).items():
        if here[name] != wanted:
            raise UnlikeWorkerError(
                f"the worker {worker.address} has {name} {here[name]}, must be {wanted}"
            )
    if worker.state.nthreads > 1:
        raise UnlikeWorkerError(
            f"the worker {worker.address} has {worker.state.nthreads} threads, must be 1: start "
            f"dask worker with --nworkers {worker.state.nthreads} --nthreads 1"
        )
    return attempt(run_trial, trial)


def versions() -> dict[str, str]:
    """Return the versions of what a trial's bits may depend on, by name."""
    from ..store.schema import RESULTS_VERSION

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
    pressed: list[int] = []
    with _handling(lambda number, _: pressed.append(number)):
        yield
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Ignore Ctrl-C, as the processes started meanwhile will do for ever: it is for the parent."""
    with _handling(signal.SIG_IGN):
        yield


@contextmanager
def _handling(handler: Any) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # Python tells the main thread only, and lets no other change that
        return
    usual = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
