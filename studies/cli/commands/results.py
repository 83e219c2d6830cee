"""``nested-agents results``: what a study measured, for reading and for other programs."""

from pathlib import Path

import click

from ...presentation.row_formats import Format, write_rows
from .. import options


@click.command()
@options.directory
@options.formats(
    "table",
    "csv",
    "json",
    text="How to print the rows; CSV and JSON hold every digit, and a column for every swept key.",
)
@click.option(
    "--phase",
    metavar="PHASE",
    default="training",
    help="The episodes of training, those of the greedy evaluation after it (evaluation), of a "
    "stage before it (training:NAME) or of another evaluation (evaluation:NAME).",
)
def command(directory: Path, form: Format, phase: str) -> int:
    """Print one row per trial and episode, as a table, CSV or JSON.

    DIR is where the study is kept.
    """
    import sys

    from ....core.plugins.settings import closest
    from ...errors import SpecError
    from ...results.results import read
    from ..loading import opened

    with opened(directory) as store:
        store.verify()
        results = read(store)
    if results.phases and phase not in results.phases:
        raise SpecError(f"--phase {phase!r}: {closest(phase, results.phases)}")
    episodes = results.episodes
    write_rows(episodes[episodes["phase"] == phase], results.measures, form, sys.stdout)
    return 0
