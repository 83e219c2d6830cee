"""``nested-agents status``: how far a study is."""

from pathlib import Path

import click

from .. import options


@click.command()
@options.directory
def command(directory: Path) -> int:
    """Tell how many trials are done, running, failed (with the reason) and left, and for how long.

    DIR is where the study is kept.
    """
    from ...store.store import Store
    from ..standing import describe, progress, warnings

    with Store.open(directory) as store:
        now = progress(store)
        print(*describe(store, now), sep="\n")
        failed = store.failed()
    for line in warnings(now):
        print(line)
    for condition, seed, error in failed:
        print(f"\n{condition}, seed {seed} failed:\n{error.rstrip()}")
    if failed:
        print(f"\nto run them again: nested-agents retry {directory}")
    return 1 if failed else 0
