"""Workers of a local Dask cluster, or of a running one.

A cluster has an idea of its own of what to do when a worker dies: it hands the trial to another
one, and gives up after some deaths (`allowed-failures` in its configuration; none in a cluster
started here). Only then is the trial lost. Workers may join and leave at any time.
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
from .nursery import Answer, call_for
from .runner import ONE_THREAD, Outcome, RunTrial, Workers, beginning_processes, versions

CONNECT = 10.0
"""Timeout for connecting to a scheduler [s]."""

PATIENCE = 60.0
"""Timeout for the first worker, or for a new one when all have gone [s]."""


class UnlikeWorkerError(Exception):
    """A worker on which a trial might give other bits, or could not run; one line."""


def call_alike(
    expected: dict[str, str], function: Callable[..., Outcome | Answer], *arguments: object
) -> Outcome | Answer:
    """Run a trial on a worker that somebody else started, if it is as `expected`; see `call_for`.

    Raises
    ------
    UnlikeWorkerError
        If its versions are not the `expected` ones, see `versions`, or it uses several threads.
    """
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
    return function(*arguments)


class DaskWorkers(Workers[Future]):
    """Workers of a Dask cluster; see `Workers`. Use `DaskWorkers.local` or `DaskWorkers.at`.

    Parameters
    ----------
    client
        Connected to the cluster.
    most
        Most trials at a time; None: one for every worker.
    name
        What to call the cluster in messages.
    """

    def __init__(self, client: Client, most: int | None, name: str) -> None:
        self._client = client
        self._most = most
        self._name = name
        self._alone_since: float | None = None  # when there was no worker any more

    @classmethod
    @contextmanager
    def local(cls, jobs: int) -> Iterator[DaskWorkers]:
        """Start a cluster of `jobs` workers on this machine; it ends with the context."""
        with _quiet():
            with beginning_processes():
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
        """Use the cluster with its scheduler at `address`, with at most `jobs` trials at a time.

        Raises
        ------
        SpecError
            If it cannot be reached.
        """
        with _quiet():
            try:
                get_backend(parse_address(address)[0])  # a client may fail on others by assertion
                client = Client(address, timeout=CONNECT)
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
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        elif now - self._alone_since > PATIENCE:
            raise SpecError(
                f"{self._name} has had no worker for {PATIENCE:.0f} s; what has finished "
                "is kept, the same command continues"
            )
        return workers if self._most is None else min(workers, self._most)

    def submit(self, run_trial: RunTrial, trial: Trial) -> Future:
        """See `Workers.submit`."""
        call = call_for(run_trial, trial)
        return self._client.submit(call_alike, versions(), *call, pure=False)

    def fetch(self, future: Future, trial: Trial) -> Outcome | None:
        """See `Workers.fetch`."""
        try:
            result: Outcome | Answer = future.result(timeout=CONNECT)
        except TimeoutError:
            return None  # the worker that held the result died
        except KilledWorker:
            self._alone_since = None
            return Outcome(trial, f"killed, in {self._name}", 0.0, lost=True)
        except UnlikeWorkerError as error:
            raise SpecError(f"{self._name}: {error}") from None
        except (CancelledError, CommClosedError):
            raise self._gone() from None
        except ImportError as error:
            raise SpecError(f"{self._name}: a worker cannot begin: {error}") from None
        return result if isinstance(result, Outcome) else result.outcome(trial)

    def stop(self, futures: Sequence[Future]) -> None:
        """See `Workers.stop`."""
        with suppress(OSError, ValueError, CancelledError):
            self._client.cancel(list(futures), force=True)

    def _gone(self) -> SpecError:
        return SpecError(
            f"{self._name} is gone; what has finished is kept, the same command continues"
        )


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the logs and warnings of the cluster: what matters is reported in one line."""
    with warnings.catch_warnings(action="ignore"), ExitStack() as stack:
        for logger in map(logging.getLogger, ("distributed", "tornado", "asyncio")):
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)
        yield
