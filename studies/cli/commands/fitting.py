"""The command that fits laws of growth to the results of a study."""

from pathlib import Path

import click

from .. import options
from ..display import Form, in_form, print_data, print_table, print_text, save_plot
from ..loading import read_results, say_remarks


@click.command()
@options.sources
@options.measure
@options.phase
@options.size
@click.option(
    "--criterion",
    type=float,
    metavar="SHARE",
    help="Fit the number of training decisions until this share of five episodes in a row "
    "succeeds; runs that never reach it are censored.",
)
@click.option(
    "--predict",
    type=click.IntRange(1),
    multiple=True,
    metavar="N...",
    help="Predict these sizes, which were not run: the mean over as many new seeds, with its 90% "
    "interval.",
)
@options.columns
@options.plot
@options.where
@options.form
@options.trust
def fit(
    sources: tuple[Path, ...],
    columns: tuple[str, ...],
    plot: Path | None,
    where: str | None,
    form: Form,
    trust: bool,
    **choices: options.Checked,
) -> int:
    """Fit how results grow with the size of teams: exponents, floors, break points, predictions.

    DIR is the folder of a study that sweeps a size, FILE a file of results or a table of scores as
    compare reads it. Several folders are fitted together if their specs are equal except for the
    size. Conditions that differ only in the size are fitted by one law: a power law, possibly with
    a floor or a break point, or a logistic curve for rates. The command chooses the law that,
    fitted to the smaller sizes, best predicts the largest ones.
    """
    from ...api.growth import scaling_law

    loaded = read_results(sources, where=where, trust=trust, columns=columns)
    say_remarks(loaded)
    growth = scaling_law(loaded, **choices)
    if plot is not None:
        save_plot(growth.figure, plot)
    if form != "table":
        print_data(in_form(growth.table, form))
        return 0
    print_text(growth.analysis.title)
    if growth.analysis.table:
        print_table(growth.table, growth.analysis.legend)
    print_text(*growth.notes)
    return 0
