"""What the user sees of a study on the terminal: its table, and where things are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from ..api.study import StudyResults
from ..presentation.tables import NOTHING, SummaryTable
from ..presentation.terminal_tables import print_rows


def print_table(found: SummaryTable) -> None:
    """Print estimates by condition, each over its 95 % interval."""
    if not found.rows:
        print(NOTHING)
        return
    print_rows(found.titles, found.rows, Console())
    for line in found.legend:
        print(line)


def print_study(study: StudyResults, columns: Sequence[str] = ()) -> None:
    """Print the table of a study and what it says of its results."""
    print_table(study.table(columns))
    for note in study.notes:
        print(note)
    if not any(note.startswith("Power:") for note in study.notes):
        for line in study.power:
            print(line)


def print_places(directory: Path, figures: Sequence[Path], replays: Sequence[Path]) -> None:
    """Say where pictures and results are."""
    print()
    for what, paths in (("figure", figures), ("replay", replays)):
        for path in paths:
            print(f"{what:<8}{path}")
    print(f"{'rows':<8}nested-agents results {directory} --format csv")
    print(f"{'report':<8}nested-agents report {directory}")
