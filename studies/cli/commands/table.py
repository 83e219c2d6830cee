"""``nested-agents table``: the results of a study, as one table."""

from typing import Any

import click

from .. import options


@click.command()
@options.sources
@options.as_study
@options.where
@click.option(
    "--columns",
    multiple=True,
    metavar="TITLE...",
    help="Headings of the columns to print, in this order; by default all.",
)
@options.form
@options.trust
def command(columns: tuple[str, ...], form: str, **choice: Any) -> int:
    """Print conditions against estimates with their 95 % intervals, as at the end of a run.

    DIR is where a study is kept; several are analysed together, as the first one says. FILE.json is
    a file of results that `export --format json` has written.
    """
    from ..display import print_study
    from ..loading import load_results

    results = load_results(**choice)
    if form == "table":
        print_study(results, columns)
    else:
        print(getattr(results.table(columns), form), end="")
    return 0
