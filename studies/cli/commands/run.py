"""``nested-agents run``: run the study of a spec."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from .options import Address, Backend, Changes, MostJobs


def command(
    spec: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SPEC.toml")],
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")],
    jobs: MostJobs = None,
    backend: Backend = "loky",
    address: Address = None,
    accept_code: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    set: Changes = (),
) -> int:
    """Run the study of a spec; the same command again continues it.

    Parameters
    ----------
    spec
        What to run; `nested-agents demo --print-spec` prints an example.
    out
        Where to keep the study; made if it does not exist. Every trial is kept the moment it
        finishes, so interrupting costs only those that are running.
    jobs
        Trials at a time; one for every core, or for every worker at the address.
    backend
        Who runs them: loky, processes of this machine, or dask, workers of a Dask cluster (extra
        nested-agents[dask]). The results are the same.
    address
        Of the scheduler of a running Dask cluster; if missing, one is started here.
    accept_code
        Go on with a study although the installed code that computes it has changed since.
    set
        Lay a value over the spec: --set learner.ridge=1 --set "seeds=[3, 5]". May be repeated.
    """
    from ...spec.spec import Spec
    from ..conduct import conduct

    return conduct(
        Spec.load(spec, set), out, jobs, backend=backend, address=address, accept_code=accept_code
    )
