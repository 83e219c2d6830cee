"""The command that measures what losses of agents cost trained teams."""

from pathlib import Path
from typing import Any

import click

from ...presentation.progress import say
from .. import options
from ..display import Form, in_form, print_data, print_table, print_text
from ..loading import read_results, say_remarks


@click.command()
@options.directory
@click.option(
    "--fault",
    default="absent",
    metavar="KIND",
    help="How agents are lost: absent (they neither act nor communicate), left (the hierarchy is "
    "repaired), lost (their messages are lost), or a kind of failure of the scenario, such as "
    "seized, in which an actuator fails.",
)
@options.measure
@click.option(
    "--sets",
    "max_sets",
    type=int,
    metavar="N",
    default=20,
    help="Maximum number of sets of lost agents to evaluate, for each size of two or more.",
)
@options.number(
    "--tolerance", "SHARE", 0.1, "Share of the intact performance that a tolerated loss may cost."
)
@options.out("Folder for figures of the hierarchies; agents are colored by the cost of loss.")
@options.jobs
@options.where
@options.form
@options.trust
def resilience(
    directory: Path,
    out: Path | None,
    where: str | None,
    form: Form,
    trust: bool,
    **choices: Any,
) -> int:
    """Measure what the loss of one, two or more agents costs trained teams.

    DIR is the folder of a study that keeps its teams (keep_teams = true). Teams are not trained
    again. Each agent is lost in turn, then pairs, then larger sets, until success halves.
    """
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # refused before the teams are evaluated
    loaded = read_results((directory,), where=where, trust=trust)
    say_remarks(loaded)
    report = loaded.resilience(**choices)
    if form == "json":
        print_data(report.json)
    elif form != "table":
        print_data(in_form(report.table, form))
        if report.analysis.remark:
            say(report.analysis.remark)
    else:
        print_table(report.table)
        print_text(*report.notes)
    if out is not None:
        from ...presentation.figures import save

        print_text(*save(report.figures(), out))
    return 0
