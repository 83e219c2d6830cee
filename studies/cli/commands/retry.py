"""``nested-agents retry``: run failed trials again."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@options.directory
@options.running
@options.trust
def command(directory: Path, trust: bool, **running: Any) -> int:
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
    study = run(spec, directory, retry_failed=True, observer=Terminal(), **running)
    return show_results(study)
