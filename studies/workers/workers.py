"""Who runs the trials: processes on this machine, or workers of a Dask cluster on many.

A family of siblings with one interface, distinguished by the name of their backend. Whoever runs a
trial, its bits are the same: each trial has a process to itself, linear algebra uses one thread.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal, get_args

from ...core.plugins.messages import closest
from ..errors import SpecError
from .arrivals import Workers
from .worker import cores

Backend = Literal["loky", "dask"]
"""``loky``: processes of this machine. ``dask``: workers of a Dask cluster."""


def check_jobs(jobs: int) -> None:
    """Refuse a number of processes below one."""
    if jobs < 1:
        raise SpecError(f"--jobs {jobs}: must be at least 1")


@contextmanager
def start_workers(
    backend: Backend, jobs: int | None, address: str | None, trials: int
) -> Iterator[Workers]:
    """Start workers, which end with the context, or connect to those of a cluster.

    Parameters
    ----------
    backend
        Of which kind.
    jobs
        Most trials at a time; None: one for every core, or for every worker at `address`.
    address
        Of the scheduler of a running Dask cluster; None: workers of this machine are started.
    trials
        How many trials there are; no more workers are started.

    Raises
    ------
    SpecError
        If there are none to be had; one line says why.
    """
    if jobs is not None:
        check_jobs(jobs)
    if backend not in (known := get_args(Backend)):
        raise SpecError(f"backend = {backend!r}: {closest(backend, known)}")
    wanted = max(1, min(jobs or cores(), trials))
    if backend == "loky":
        from .loky import LokyWorkers

        if address is not None:
            raise SpecError(f"--address {address}: is for --backend dask only")
        yield LokyWorkers(wanted)
        return
    try:
        from .dask import DaskWorkers
    except ModuleNotFoundError as error:
        if error.name not in ("dask", "distributed"):
            raise
        raise SpecError(
            f"--backend dask: {error.name} is not installed; pip install 'nested-agents[dask]'"
        ) from None
    if address is None:
        with DaskWorkers.local(wanted) as workers:
            yield workers
    else:
        with DaskWorkers.at(address, jobs) as workers:
            yield workers
