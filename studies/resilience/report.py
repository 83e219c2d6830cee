"""Resilience of a study's teams: table, sentences, figures and JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.notation import wrapped
from ..results.statistics import plain
from .analysis import Resilience

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class ResilienceReport(Report):
    """Costs of lost agents in trained teams; printed or shown by a notebook."""

    analysis: Resilience

    @property
    def table(self) -> SummaryTable:
        """Performance and its change by condition, position and number of losses."""
        return tabulate(self.analysis.summaries)

    @property
    def notes(self) -> tuple[str, ...]:
        """Explanation and findings, in lines."""
        texts = (*self.analysis.legend, *self.analysis.sentences)
        lines = [line for text in texts for line in wrapped(text)]
        compared = self.analysis.comparison_lines
        return (*lines, "", *compared) if compared else tuple(lines)

    @property
    def json(self) -> str:
        """Everything as JSON."""
        return json.dumps(plain(self.analysis.to_dict()), indent=1)

    def figures(self) -> dict[str, Figure]:
        """Return the hierarchy of each condition with agents colored by what their loss costs."""
        from .figure import draw  # matplotlib takes its time

        return draw(self.analysis)
