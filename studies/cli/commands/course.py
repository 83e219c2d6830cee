"""``nested-agents course``: the labs of the course, their questions, and the marks of answers."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ..arguments import Choice, Command, Text


@click.command(cls=Command)
@click.argument("action", type=Choice(["list", "sheet", "check"]), metavar="list|sheet|check")
@click.argument("arguments", type=Text(), metavar="[LAB|SHEET.toml]", nargs=-1)
@click.option(
    "--format",
    "form",
    type=Choice(["text", "csv"]),
    default="text",
    help="How to print marks: every answer, or a row for each sheet.",
)
def command(action: str, arguments: tuple[str, ...], form: str) -> int:
    """List the labs of the course, print the questions of one, or grade answers.

    sheet prints the questions of a LAB as a file to fill in; check grades such files, and exits
    with 1 unless all answers are right.
    """
    from ...course.grading import blank_sheet, grade_sheet
    from ...course.labs import LABS
    from ...presentation.csv_text import write_csv
    from ...spec.errors import SpecError

    if action == "list":
        if arguments:
            raise SpecError(f"course list {arguments[0]}: takes no argument; see course sheet")
        for name, lab in LABS.items():
            print(f"{name:<{max(map(len, LABS)) + 2}}{lab.title}")
        return 0
    if action == "sheet":
        if len(arguments) != 1:
            raise SpecError(f"course sheet: takes one LAB, got {len(arguments)}; see course list")
        print(blank_sheet(arguments[0]))
        return 0
    if not arguments:
        raise SpecError("course check: SHEET.toml is missing; course sheet LAB prints an empty one")
    graded = [grade_sheet(Path(path)) for path in arguments]
    if form == "csv":
        rows = [(m.lab, m.name, m.right, len(m.marks)) for m in graded]
        write_csv(sys.stdout, ("lab", "name", "right", "questions"), rows)
    else:
        print("\n\n".join(map(str, graded)))
    return 0 if all(m.right == len(m.marks) for m in graded) else 1
