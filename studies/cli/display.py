"""Printing on the terminal; every command prints through this module.

Labels, tracebacks and titles may come from any spec, database or published file. Control characters
in them are escaped, see `printable`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from shutil import get_terminal_size
from textwrap import fill
from typing import TYPE_CHECKING, Literal, TypeAlias

from ...core.plugins.printing import printable
from ...core.shell import command_line
from ..errors import refused

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from ..api.study import StudyResults
    from ..presentation.tables import SummaryTable

Form: TypeAlias = Literal["table", "markdown", "latex", "csv", "json"]
"""Format of a table of estimates."""


def print_text(*texts: object, sep: str = "\n", end: str = "\n") -> None:
    """Print texts, a line each unless `sep` says otherwise."""
    print(*(printable(str(text)) for text in texts), sep=sep, end=end)


def print_data(text: str) -> None:
    """Print data for other programs unchanged, but on a terminal like `print_text`."""
    sys.stdout.write(printable(text) if sys.stdout.isatty() else text)


def print_wrapped(text: str, first: str = "", indent: int = 4) -> None:
    """Print a text over the width of the terminal, after `first`; further lines are indented."""
    width = get_terminal_size().columns
    later = " " * indent
    print_text(
        fill(text, width, initial_indent=first, subsequent_indent=later, break_on_hyphens=False)
    )


def print_lines(lines: Iterable[str]) -> None:
    """Print lines; on a terminal those that are wider than it go on in the next one, indented."""
    width = get_terminal_size().columns if sys.stdout.isatty() else sys.maxsize
    for line in chain.from_iterable(text.split("\n") for text in lines):
        print_text(line if len(line) <= width else fill(line, width, subsequent_indent="  "))


def print_table(table: SummaryTable, legend: Sequence[str] | None = None) -> None:
    """Print estimates by condition, each over its 95% interval, and its legend or another one."""
    if table.lines:
        print_text(table.text(get_terminal_size().columns), "")
    print_lines(table.legend if legend is None else legend)


def in_form(table: SummaryTable, form: Form) -> str:
    """Return a table as text in a form."""
    match form:
        case "markdown":
            return table.markdown
        case "latex":
            return table.latex
        case "csv":
            return table.csv
        case "json":
            return table.json
        case "table":
            return f"{table}\n"


def print_study(study: StudyResults, columns: Sequence[str] = ()) -> None:
    """Print the table of a study, its notes and its power."""
    print_table(study.table(columns))
    print_lines(study.notes)
    if not any(note.startswith("Power:") for note in study.notes):  # one number of power a study
        print_lines(study.power)


def save_plot(draw: Callable[[], Figure], path: Path) -> None:
    """Draw and write a figure, and say where it is."""
    from ..presentation.figures import write  # Matplotlib is slow to import
    from ..presentation.progress import say

    with refused():
        write(draw(), path)
    say(f"figure  {path}")


def show_results(
    study: StudyResults, formats: Sequence[str] = (), report: Path | None = None
) -> int:
    """Print the table of a study that has been run, draw figures, and say where everything is.

    Parameters
    ----------
    study
        What has been run.
    formats
        Formats of the figures; without any, none are drawn.
    report
        Path of its report, if it has been written; without it the command is printed that does.

    Returns
    -------
    int
        1 if any trial failed, else 0.
    """
    from ..presentation.progress import count, say

    directory = study.directory
    print_study(study)
    print_text("")
    if formats:
        from ..presentation.figures import save  # Matplotlib is slow to import

        folder = directory / "figures"
        folder.mkdir(exist_ok=True)
        print_text(*(f"figure  {path}" for path in save(study.figures, folder, formats)))
    print_text(f"rows    {command_line('results', directory, '--format', 'csv')}")
    print_text(f"report  {report or command_line('report', directory)}")
    if study.failed:
        failed = count(len(study.failed), "trial")
        say(f"{failed} failed: {command_line('status', directory)}")
    return 1 if study.failed else 0
