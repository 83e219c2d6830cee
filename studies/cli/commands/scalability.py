"""The command that answers which hierarchy scales, how far, and at what cost."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from .. import options
from ..display import Form, in_form, print_data, print_lines, print_table, print_text, save_plot
from ..loading import read_results, say_remarks

if TYPE_CHECKING:
    from ...api.study import StudyResults

READING = {"sources", "columns", "better", "where", "trust"}
"""Parameters that say what is read."""


@click.command()
@options.sources
@options.measure
@options.size
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
    show_default=False,
    metavar="LIMITS",
    help='Find the best hierarchy within limits, as "messages <= 50, decision_ms <= 100".',
)
@click.option(
    "--predict",
    type=click.IntRange(1),
    multiple=True,
    metavar="N...",
    help="Write predictions for sizes that were not run to the file of --out, with 90% intervals.",
)
@options.out("Prediction file to write.", metavar="FILE.json")
@click.option(
    "--check",
    type=options.PATH,
    metavar="FILE.json",
    help="Compare the predictions of a file with these results, and say which ones held.",
)
@options.columns
@options.better
@options.plot
@options.where
@options.form
@options.trust
def scalability(
    sources: tuple[Path, ...],
    measure: str | None,
    predict: tuple[int, ...],
    out: Path | None,
    check: Path | None,
    columns: tuple[str, ...],
    better: Literal["higher", "lower"] | None,
    plot: Path | None,
    where: str | None,
    form: Form,
    trust: bool,
    **choices: options.Checked,
) -> int:
    """Show which hierarchy scales, up to how many agents, and at what cost.

    DIR is the folder of a study that sweeps a size and, to compare them, hierarchies. For every
    hierarchy and size the table has performance, speed-up, efficiency, serial fraction and costs.
    The text names the best team size by the universal scalability law, sizes from which on one
    hierarchy beats another, and the hierarchies on the Pareto front of performance and cost.
    """
    if check is not None:
        options.refuse_unused("with --check", READING | {"check", "form"})
    elif predict:
        options.refuse_unused("with --predict", READING | {"predict", "out", "measure", "size"})
    elif out is not None:
        raise click.UsageError("--out: is not used without --predict")
    loaded = read_results(sources, where=where, trust=trust, columns=columns, better=better)
    say_remarks(loaded)
    if check is not None:
        return _check(loaded, check, form)
    if predict:
        if out is None:
            raise click.UsageError("--predict: needs --out FILE.json")
        predicted = loaded.predict_sizes(predict, out, measure, size=choices["size"])
        print_table(predicted.table, ())
        print_text(*predicted.notes)
        return 0
    report = loaded.scalability(measure, **choices)
    if plot is not None:
        save_plot(report.figure, plot)
    if form == "json":
        print_data(report.json)
    elif form != "table":
        print_data(in_form(report.table, form))
        if form in ("latex", "markdown") and report.universal_laws:
            print_data(f"\n{in_form(report.laws, form)}")
    else:
        print_table(report.table)
        if report.universal_laws:
            print_table(report.laws, ())
        print_text(*report.notes)
    return 0


def _check(loaded: StudyResults, file: Path, form: Form) -> int:
    """Print which predictions of a file held."""
    checked = loaded.check_prediction(file)
    if form == "json":
        print_data(json.dumps(checked.to_dict(), indent=1))
    elif form != "table":
        print_data(in_form(checked.table, form))
    else:
        print_table(checked.table, ())
        print_lines(checked.notes)
    return 0
