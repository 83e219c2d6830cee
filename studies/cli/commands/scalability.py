"""The command that answers which hierarchy scales, how far, and at which cost."""

from pathlib import Path

import click

from ...errors import refused
from .. import options
from ..display import Form, in_form, print_data, print_table, print_text
from ..loading import read_results, say_remarks


@click.command()
@options.sources
@options.measure
@click.option(
    "--size",
    metavar="KEY",
    help="The swept key that is the size, as robots; by default the only one of numbers.",
)
@click.option(
    "--scaling",
    type=click.Choice(["strong", "weak"]),
    help="Whether the task is the same for all sizes (strong) or grows with the team (weak); by "
    "default as the scenario says.",
)
@click.option(
    "--criterion",
    type=float,
    metavar="SHARE",
    help="Also count the decisions of training until this share of five episodes in a row "
    "succeeds.",
)
@click.option(
    "--budget",
    default="",
    metavar="LIMITS",
    help='Find the best hierarchy within limits, as "messages <= 50, decision_ms <= 100".',
)
@options.columns
@options.plot
@options.where
@options.form
@options.trust
def scalability(
    sources: tuple[Path, ...],
    measure: str | None,
    columns: tuple[str, ...],
    plot: Path | None,
    where: str | None,
    form: Form,
    trust: bool,
    **choices: str | float | None,
) -> int:
    """Show which hierarchy scales, up to how many agents, and at which cost.

    DIR is the folder of a study that sweeps a size and, to compare them, hierarchies. For every
    hierarchy and size the table has performance, speed-up, efficiency, serial fraction and costs.
    The text names the best team size by the universal scalability law, sizes from which on one
    hierarchy beats another, and the hierarchies on the Pareto front of performance and cost.
    """
    loaded = read_results(sources, where=where, trust=trust, columns=columns)
    say_remarks(loaded)
    report = loaded.scalability(measure, **choices)  # type: ignore[arg-type]
    if plot is not None:
        from ...presentation.figures import write

        with refused():
            write(report.figure(), plot)
    if form == "json":
        print_data(report.json)
    elif form != "table":
        print_data(in_form(report.table, form))
        if form in ("latex", "markdown") and report.analysis.laws:
            print_data(f"\n{in_form(report.laws, form)}")
    else:
        print_table(report.table, report.table.legend)
        if report.analysis.laws:
            print_table(report.laws, ())
        print_text(*report.notes)
    return 0
