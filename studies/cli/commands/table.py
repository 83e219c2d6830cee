"""``nested-agents table``: the results of a study, as one table."""

from __future__ import annotations

from pathlib import Path

import click

from .. import options


@click.command()
@click.argument("sources", type=options.PATH, metavar="DIR...|FILE.json", nargs=-1, required=True)
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
def command(
    sources: tuple[Path, ...],
    study: str | None,
    where: str | None,
    columns: tuple[str, ...],
    form: str,
    trust: bool,
) -> int:
    """Print conditions against estimates with their 95 % intervals, as at the end of a run.

    DIR is where a study is kept; several are analysed together, as the first one says. FILE.json is
    a file of results that `export --format json` has written.
    """
    from ..display import print_study
    from ..loading import load_results

    results = load_results(sources, study, where, is_trusted=trust)
    if form == "table":
        print_study(results, columns)
    else:
        print(getattr(results.table(columns), form), end="")
    return 0
