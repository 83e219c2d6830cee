"""``nested-agents table``: what a study found, as one table."""

from __future__ import annotations

from pathlib import Path

import click

from .. import options


@click.command()
@click.argument("sources", type=options.path, metavar="DIR...|FILE.json", nargs=-1, required=True)
@options.as_study
@options.where
@click.option(
    "--columns",
    multiple=True,
    type=options.text,
    metavar="TITLE...",
    help="Headings of the columns to print, in this order; all unless said otherwise.",
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
    from ..asking import asked
    from ..display import print_study

    found = asked(sources, study, where, trust=trust)
    if form == "table":
        print_study(found, columns)
    else:
        print(getattr(found.table(columns), form), end="")
    return 0
