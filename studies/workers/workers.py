"""Who runs the trials: processes on this machine, or workers of a Dask cluster on many.

Whoever runs a trial, its bits are the same: each trial has a process to itself, linear algebra uses
one thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import SpecError
from .arrivals import Workers
from .worker import cores


def check_jobs(jobs: int) -> None:
    """Refuse a number of processes below one."""
    if jobs < 1:
        raise SpecError(f"--jobs {jobs}: must be at least 1")


@contextmanager
def start_workers(jobs: int | None, address: str | None, trials: int) -> Iterator[Workers]:
    """Start workers, which end with the context, or connect to those of a cluster.

    Parameters
    ----------
    jobs
        Most trials at a time; None: one for every core, or for every worker at `address`.
    address
        Of the scheduler of a running Dask cluster; None: processes of this machine are started.
    trials
        How many trials there are; no more processes are started.

    Raises
    ------
    SpecError
        If there are none to be had; one line says why.
    """
    if jobs is not None:
        check_jobs(jobs)
    if address is None:
        from .loky import LokyWorkers

        yield LokyWorkers(max(1, min(jobs or cores(), trials)))
        return
    try:
        from .dask import DaskWorkers
    except ModuleNotFoundError as error:
        if error.name not in ("dask", "distributed"):
            raise
        raise SpecError(
            f"--address {address}: {error.name} is not installed; pip install 'nested-agents[dask]'"
        ) from None
    with DaskWorkers.at(address, jobs) as workers:
        yield workers
