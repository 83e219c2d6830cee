"""``nested-agents compare``: conditions against each other, seed by seed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@click.argument("sources", type=options.PATH, metavar="DIR...|FILE.json", nargs=-1, required=True)
@click.option(
    "--by",
    metavar="KEY",
    help="Compare conditions that differ in this swept key alone, as robots or topology; "
    "directory compares studies. By default all conditions with the first.",
)
@click.option(
    "--measure",
    metavar="NAME",
    default="success",
    help="A measure of episodes, steps, return, or a number of whole trials.",
)
@click.option("--phase", metavar="PHASE", help="Of the episodes; evaluation, if there is one.")
@click.option(
    "--reference", metavar="LABEL", help="What the others are compared with; by default the first."
)
@options.where
@options.form
@options.trust
def command(
    sources: tuple[Path, ...], where: str | None, form: str, trust: bool, **compared: Any
) -> int:
    """Compare conditions of one study or several: effect, interval, p raw and adjusted, power.

    DIR is where a study is kept, FILE.json a file of results. Conditions are compared on the seeds
    that both have, on equal worlds.
    """
    from ..display import print_table
    from ..loading import load_results

    results = load_results(sources, None, where, is_trusted=trust)
    comparison = results.compare(**compared)
    if form == "table":
        print_table(comparison.table)
        print("", *comparison.verdicts, sep="\n")
    else:
        print(getattr(comparison.table, form), end="")
    return 0
