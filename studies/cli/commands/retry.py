"""``nested-agents retry``: run failed trials again."""

from __future__ import annotations

from typing import Annotated

import tyro

from .options import Address, Backend, Directory, MostJobs


def command(
    directory: Directory,
    jobs: MostJobs = None,
    backend: Backend = "loky",
    address: Address = None,
    accept_code: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Run the failed trials of a study again, and whatever is left of it.

    Parameters
    ----------
    directory
        Where the study is kept.
    jobs
        Trials at a time; one for every core, or for every worker at the address.
    backend
        Who runs them: loky, processes of this machine, or dask, workers of a Dask cluster (extra
        nested-agents[dask]). The results are the same.
    address
        Of the scheduler of a running Dask cluster; if missing, one is started here.
    accept_code
        Go on with a study although the installed code that computes it has changed since.
    """
    from ...store.store import Store
    from ..conduct import conduct

    with Store.open(directory) as store:
        spec = store.spec()
    return conduct(
        spec,
        directory,
        jobs,
        backend=backend,
        address=address,
        retry_failed=True,
        accept_code=accept_code,
    )
