"""``nested-agents compare``: conditions against each other, seed by seed."""

from __future__ import annotations

from pathlib import Path

import click

from .. import options


@click.command()
@click.argument("sources", type=options.path, metavar="DIR...|FILE.json", nargs=-1, required=True)
@click.option(
    "--by",
    type=options.text,
    metavar="KEY",
    help="Compare conditions that differ in this swept key alone, as robots or topology; "
    "directory compares studies. All conditions with the first unless said otherwise.",
)
@click.option(
    "--measure",
    type=options.text,
    metavar="NAME",
    default="success",
    help="A measure of episodes, steps, return, or a number of whole trials.",
)
@click.option(
    "--phase",
    type=options.text,
    metavar="PHASE",
    help="Of the episodes; evaluation, if there is one.",
)
@click.option(
    "--reference",
    type=options.text,
    metavar="LABEL",
    help="What the others are compared with; the first unless said otherwise.",
)
@options.where
@options.form
@options.trust
def command(
    sources: tuple[Path, ...],
    by: str | None,
    measure: str,
    phase: str | None,
    reference: str | None,
    where: str | None,
    form: str,
    trust: bool,
) -> int:
    """Compare conditions of one study or several: effect, interval, p raw and adjusted, power.

    DIR is where a study is kept, FILE.json a file of results. Conditions are compared on the seeds
    that both have, on equal worlds.
    """
    from ..asking import asked
    from ..display import print_table

    found = asked(sources, None, where, trust=trust).compare(
        by, measure, phase=phase, reference=reference
    )
    if form == "table":
        print_table(found.table)
        print()
        for line in found.verdicts:
            print(line)
    else:
        print(getattr(found.table, form), end="")
    return 0
