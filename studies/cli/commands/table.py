"""``nested-agents table``: what a study found, as one table."""

from __future__ import annotations

from pathlib import Path

import click

from ..arguments import Choice, Command, File, Several, Text
from . import options


@click.command(cls=Command)
@click.argument("source", type=File(), metavar="DIR|FILE.json")
@click.option(
    "--columns",
    cls=Several,
    type=Text(),
    metavar="TITLE...",
    help="Headings of the columns to print, in this order; all unless said otherwise.",
)
@click.option(
    "--format",
    "form",
    type=Choice(["table", "markdown", "latex", "csv"]),
    default="table",
    help="How to print the table; CSV holds every digit.",
)
@options.trust
def command(source: Path, columns: tuple[str, ...], form: str, trust: bool) -> int:
    """Print conditions against estimates with their 95 % intervals, as at the end of a run.

    DIR is where a study is kept, FILE.json a file of its results that `export --format json` has
    written.
    """
    from ....core.sources import Sources
    from ...analysis import published
    from ...analysis.results import read
    from ...catalogue.study import load_study
    from ...presentation.tables import tabulate
    from ...store.store import Store
    from ..display import print_table, say
    from ..trusting import trust_files

    if source.is_file():
        of_file = published.load(source)
        outline, results, _ = of_file
        sources = Sources()
        if of_file.note:
            say(f"{source}: {of_file.note}")
    else:
        if trust:
            trust_files(source)
        with Store.open(source) as store:
            store.verify()
            outline, results, sources = store.outline(), read(store), store.sources()
    with sources.active():
        found = tabulate(load_study(outline.study).analyse(results).table, columns)
    if form == "table":
        print_table(found)
    else:
        print(getattr(found, form), end="")
    return 0
