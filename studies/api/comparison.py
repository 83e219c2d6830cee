"""Conditions of a study compared with each other: verdicts, statistics of runs, figure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.aggregates import Aggregates, aggregate
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

    @cached_property
    def table(self) -> SummaryTable:
        """Estimates and differences, in all forms."""
        return tabulate(self.analysis.table)

    @property
    def differences(self) -> tuple[Difference, ...]:
        """Every difference with its interval, and p raw and adjusted."""
        return self.analysis.differences

    @property
    def tables(self) -> tuple[SummaryTable]:
        """The table of estimates."""
        return (self.table,)

    @property
    def notes(self) -> tuple[str, ...]:
        """Verdicts, their power and remarks, line by line."""
        return (*self.analysis.notes, *self.remarks)

    @cached_property
    def statistics(self) -> Aggregates:
        """Interquartile means, probabilities of improvement and performance profiles.

        Raises
        ------
        SpecError
            If no two conditions have two runs each, on common items if any.
        """
        return aggregate(self.analysis)

    @cached_property
    def aggregated(self) -> SummaryTable:
        """The table of `statistics`, in all forms."""
        return tabulate(self.statistics.table)

    def figure(self) -> Figure:
        """Return performance profiles, and the interquartile mean by episode of training."""
        from ..presentation.figures import draw_profiles  # matplotlib takes its time

        return draw_profiles(self.statistics)

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
            notes += ["", str(self.aggregated), "", *self.statistics.notes]
            figures["runs"] = self.figure()
        title = self.analysis.title
        durable.write(file, comparison_page(title, sources, notes, self.table, figures).encode())
        return file
