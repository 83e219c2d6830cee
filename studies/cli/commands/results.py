"""``nested-agents results``: what a study measured, for reading and for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..arguments import Choice, Command
from . import options

if TYPE_CHECKING:
    from ...presentation.row_formats import Format


@click.command(cls=Command)
@options.directory
@click.option(
    "--format",
    "form",
    type=Choice(["table", "csv", "json"]),
    default="table",
    help="How to print the rows; CSV and JSON hold every digit, and a column for every swept key.",
)
@click.option(
    "--phase",
    type=Choice(["training", "evaluation"]),
    default="training",
    help="The episodes of training, or those of the greedy evaluation after it.",
)
def command(directory: Path, form: Format, phase: str) -> int:
    """Print one row per trial and episode, as a table, CSV or JSON.

    DIR is where the study is kept.
    """
    import sys

    from ...presentation.row_formats import write_rows
    from ...store.store import Store

    with Store.open(directory) as store:
        store.verify()
        measures = store.measures()
        names, rows = store.rows(phase)
    write_rows(names, rows, measures, form, sys.stdout)
    return 0
