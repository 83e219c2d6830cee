"""``nested-agents table``: what a study found, as one table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro


def command(
    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR|FILE.json")],
    columns: Annotated[
        tuple[str, ...], tyro.conf.arg(metavar="TITLE [TITLE ...]", help_behavior_hint="")
    ] = (),
    format: Literal["table", "markdown", "latex", "csv"] = "table",
) -> int:
    """Print conditions against estimates with their 95 % intervals, as at the end of a run.

    Parameters
    ----------
    source
        Where a study is kept, or a file of its results that `export --format json` has written.
    columns
        Headings of the columns to print, in this order; all unless said otherwise.
    format
        How to print the table; CSV holds every digit.
    """
    from ....core.sources import Sources
    from ...analysis import published
    from ...analysis.results import read
    from ...catalogue.study import load_study
    from ...presentation.tables import tabulate
    from ...store.store import Store
    from ..display import print_table, say

    if source.is_file():
        of_file = published.load(source)
        outline, results, _ = of_file
        sources = Sources()
        if of_file.note:
            say(f"{source}: {of_file.note}")
    else:
        with Store.open(source) as store:
            store.verify()
            outline, results, sources = store.outline(), read(store), store.sources()
    with sources.active():
        found = tabulate(load_study(outline.study).analyse(results).table, columns)
    if format == "table":
        print_table(found)
    else:
        print(getattr(found, format), end="")
    return 0
