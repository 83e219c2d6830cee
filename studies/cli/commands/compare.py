"""``nested-agents compare``: conditions against each other, seed by seed."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@options.sources
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
@options.flag(
    "--statistics",
    "Add interquartile mean and probability of improvement, over the groups of --by as tasks.",
)
@options.plot
@options.where
@options.form
@options.trust
def command(
    sources: tuple[Path, ...],
    statistics: bool,
    plot: Path | None,
    where: str | None,
    form: str,
    trust: bool,
    **compared: Any,
) -> int:
    """Compare conditions of one study or several: effect, interval, p raw and adjusted, power.

    DIR is where a study is kept, FILE.json a file of results. Conditions are compared on the seeds
    that both have, on equal worlds.
    """
    from ...errors import refused
    from ..display import print_table
    from ..loading import load_results

    results = load_results(sources, where=where, trust=trust)
    comparison = results.compare(**compared)
    if plot is not None:
        from ...presentation.figures import write

        with refused():
            write(comparison.figure(), plot)
    tables = [comparison.table, *([comparison.aggregated] if statistics else [])]
    if form != "table":
        print(*(getattr(table, form) for table in tables), sep="\n", end="")
        return 0
    print_table(tables[0])
    print("", *comparison.verdicts, sep="\n")
    if statistics:
        print()
        print_table(tables[1], comparison.statistics.notes)
    return 0
