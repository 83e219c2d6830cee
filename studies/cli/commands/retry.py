"""``nested-agents retry``: run failed trials again."""

from __future__ import annotations

from pathlib import Path

import click

from ...workers.workers import Backend
from .. import options


@click.command()
@options.directory
@options.jobs
@options.backend
@options.address
@options.accept_code
@options.trust
def command(
    directory: Path,
    jobs: int | None,
    backend: Backend,
    address: str | None,
    accept_code: bool,
    trust: bool,
) -> int:
    """Run the failed trials of a study again, and whatever is left of it.

    DIR is where the study is kept.
    """
    from ...api.study import run
    from ...presentation.progress import Terminal
    from ...store.store import Store
    from ...trials.keeping import spec_of
    from ..display import show_results
    from ..loading import trust_files

    if trust:
        trust_files(directory)
    with Store.open(directory) as store:
        spec = spec_of(store)
    study = run(
        spec, directory, jobs=jobs, backend=backend, address=address, retry_failed=True,
        accept_code=accept_code, observer=Terminal(),
    )  # fmt: skip
    return show_results(study)
