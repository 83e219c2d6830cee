"""Conditions of a study compared with each other: verdicts, statistics of runs, figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.aggregates import aggregate
from ..results.comparison import ComparisonTable
from ..results.differences import Difference
from ..store import durable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Comparison(Report):
    """Conditions compared by one measure; printed or shown by a notebook, table and verdicts."""

    analysis: ComparisonTable
    """The analysis."""
    remarks: tuple[str, ...] = ()
    """Remarks on the conditions, line by line."""

    @property
    def table(self) -> SummaryTable:
        """Estimates and differences, in all forms."""
        return tabulate(self.analysis.table)

    @property
    def differences(self) -> tuple[Difference, ...]:
        """Every difference with its interval, and p raw and adjusted."""
        return self.analysis.differences

    @property
    def notes(self) -> tuple[str, ...]:
        """Verdicts, their power and remarks, line by line."""
        return (*self.analysis.notes, *self.remarks)

    @cached_property
    def aggregated(self) -> tuple[SummaryTable, Sequence[str]]:
        """Table of interquartile means and probabilities of improvement, and their meaning.

        Raises
        ------
        SpecError
            If no two conditions have two runs each, on common items if any.
        """
        lines, notes = aggregate(self.analysis)
        return tabulate(lines), notes

    def figure(self) -> Figure:
        """Return performance profiles."""
        from ..presentation.figures import draw_profiles  # matplotlib takes its time

        return draw_profiles(self.analysis)

    def report(self, path: str | PathLike[str], sources: str = "") -> Path:
        """Write verdicts, table, statistics and figure as one self-contained HTML file.

        Parameters
        ----------
        path
            Of the file.
        sources
            Where the results are from, as the page says it.

        Raises
        ------
        SpecError
            If the path is no HTML file.
        """
        from ..report.page import check_path, comparison_page

        file = Path(path)
        check_path(file)
        notes = [*self.notes]
        figures: dict[str, Figure] = {}
        if any(len(runs) > 1 for group in self.analysis.groups for runs in group.values.values()):
            table, meanings = self.aggregated
            notes += ["", str(table), "", *meanings]
            figures["runs"] = self.figure()
        title = self.analysis.title
        durable.write(file, comparison_page(title, sources, notes, self.table, figures).encode())
        return file
