"""``nested-agents results``: what a study measured, for reading and for other programs."""

from __future__ import annotations

from typing import Literal

from .options import Directory


def command(
    directory: Directory,
    format: Literal["table", "csv", "json"] = "table",
    phase: Literal["training", "evaluation"] = "training",
) -> int:
    """Print one row per trial and episode, as a table, CSV or JSON.

    Parameters
    ----------
    directory
        Where the study is kept.
    format
        How to print the rows; CSV and JSON hold every digit, and a column for every swept key.
    phase
        The episodes of training, or those of the greedy evaluation after it.
    """
    import sys

    from ...presentation.row_formats import write_rows
    from ...store.store import Store

    with Store.open(directory) as store:
        store.verify()
        measures = store.measures()
        names, rows = store.rows(phase)
    write_rows(names, rows, measures, format, sys.stdout)
    return 0
