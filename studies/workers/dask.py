"""Workers of a new local Dask cluster, or of a running cluster.

When a worker dies, the cluster gives its trial to another worker. The trial is lost after
`allowed-failures` deaths, a setting of the cluster; a local cluster allows none. Workers may join
and leave at any time.
"""

from __future__ import annotations

import logging
import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress

from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster, get_worker
from distributed.comm.addressing import parse_address
from distributed.comm.core import CommClosedError
from distributed.comm.registry import get_backend

from ..errors import SpecError
from ..trials.trial import Trial
from .fork_server import Answer, call_for, outcome_of
from .runner import ONE_THREAD, Outcome, RunTrial, Workers, starting_processes, versions

CONNECT_TIMEOUT_S = 10.0
"""Timeout for connecting to a scheduler [s]."""

WORKER_TIMEOUT_S = 60.0
"""Timeout for the first worker, or for a new one when all have gone [s]."""


def call_if_compatible(
    expected: dict[str, str], function: Callable[..., Outcome | Answer], *arguments: object
) -> Outcome | Answer:
    """Call a function of `call_for` on a worker of the cluster if its versions are `expected`.

    Raises
    ------
    SpecError
        If its `versions` differ, or it uses several threads: it might give other bits.
    """
    worker = get_worker()
    here = versions() | {name: os.environ.get(name, "not set") for name in ONE_THREAD}
    for name, wanted in (expected | ONE_THREAD).items():
        if here[name] != wanted:
            raise SpecError(
                f"the worker {worker.address} has {name} {here[name]}, must be {wanted}"
            )
    if worker.state.nthreads > 1:
        raise SpecError(
            f"the worker {worker.address} has {worker.state.nthreads} threads, must be 1: start "
            f"dask worker with --nworkers {worker.state.nthreads} --nthreads 1"
        )
    return function(*arguments)


class DaskWorkers(Workers):
    """Workers of a Dask cluster; see `Workers`. Use `DaskWorkers.local` or `DaskWorkers.at`.

    Parameters
    ----------
    client
        Client that is connected to the cluster.
    max_trials
        Maximum number of trials at a time; None: one for each worker.
    name
        Name of the cluster in messages.
    """

    def __init__(self, client: Client, max_trials: int | None, name: str) -> None:
        self._client = client
        self._max_trials = max_trials
        self._name = name
        self._empty_since: float | None = None  # time when the last worker left

    @classmethod
    @contextmanager
    def local(cls, jobs: int) -> Iterator[DaskWorkers]:
        """Start a cluster of `jobs` workers on this machine, which ends with the context."""
        with _quiet():
            with starting_processes():
                cluster = LocalCluster(
                    n_workers=jobs,
                    threads_per_worker=1,
                    env=ONE_THREAD,
                    memory_limit=0,
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                    scheduler_kwargs={"allowed_failures": 0},
                )
            with cluster, Client(cluster) as client:
                yield cls(client, jobs, "the local Dask cluster")

    @classmethod
    @contextmanager
    def at(cls, address: str, jobs: int | None) -> Iterator[DaskWorkers]:
        """Connect to the scheduler at `address` and run at most `jobs` trials at a time.

        Raises
        ------
        SpecError
            If the scheduler cannot be reached.
        """
        with _quiet():
            try:
                get_backend(
                    parse_address(address)[0]
                )  # Client reports an unknown protocol by an AssertionError only
                client = Client(address, timeout=CONNECT_TIMEOUT_S)
            except (OSError, ValueError, AssertionError) as error:
                why = " ".join(str(error).split()) or "no scheduler answers"
                raise SpecError(f"--address {address}: {why}") from None
            with client:
                yield cls(client, jobs, f"the Dask cluster at {address}")

    @property
    def processes(self) -> int:
        """Number of trials that the present workers run at a time."""
        try:
            workers = len(self._client.nthreads())
        except (OSError, ValueError) as error:
            raise self._gone() from error
        now = time.monotonic()
        if workers:
            self._empty_since = None
        elif self._empty_since is None:
            self._empty_since = now
        elif now - self._empty_since > WORKER_TIMEOUT_S:
            raise SpecError(
                f"{self._name} has had no worker for {WORKER_TIMEOUT_S:.0f} s; finished "
                "trials are stored, the same command continues"
            )
        return workers if self._max_trials is None else min(workers, self._max_trials)

    def submit(self, run_trial: RunTrial, trial: Trial) -> Future:
        """Run a trial on the cluster, see `Workers.submit`."""
        call = call_for(run_trial, trial)
        return self._client.submit(call_if_compatible, versions(), *call, pure=False)

    def fetch(self, future: Future, trial: Trial) -> Outcome | None:
        """Return the outcome of a trial, see `Workers.fetch`."""
        try:
            result: Outcome | Answer = future.result(timeout=CONNECT_TIMEOUT_S)
        except TimeoutError:
            return None  # the worker that held the result died
        except KilledWorker:
            self._empty_since = None
            return Outcome(trial, f"killed, in {self._name}", 0.0, lost=True)
        except SpecError as error:
            raise SpecError(f"{self._name}: {error}") from None
        except (CancelledError, CommClosedError):
            raise self._gone() from None
        except ImportError as error:
            raise SpecError(f"{self._name}: a worker cannot start: {error}") from None
        return outcome_of(result, trial)

    def stop(self, futures: Sequence[Future]) -> None:
        """Stop trials that are running, see `Workers.stop`."""
        with suppress(OSError, ValueError, CancelledError):
            self._client.cancel(list(futures), force=True)

    def _gone(self) -> SpecError:
        return SpecError(
            f"{self._name} is gone; finished trials are stored, the same command continues"
        )


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence logs and warnings of the cluster, because errors are reported in one line."""
    with warnings.catch_warnings(action="ignore"), ExitStack() as stack:
        for logger in map(logging.getLogger, ("distributed", "tornado", "asyncio")):
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)
        yield
