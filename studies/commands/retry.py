"""``nested-agents retry``: run failed trials again."""

from __future__ import annotations

from .options import CORES, Directory, Jobs


def command(directory: Directory, jobs: Jobs = CORES) -> int:
    """Run the failed trials of a study again, and whatever is left of it.

    Parameters
    ----------
    directory
        Where the study is kept.
    jobs
        Worker processes; one for every core unless said otherwise.
    """
    from ..conduct import conduct
    from ..store import Store

    with Store.open(directory) as store:
        spec = store.spec()
    return conduct(spec, directory, jobs, retry_failed=True)
