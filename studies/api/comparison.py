"""A comparison of conditions as a Python user holds it: verdicts, table, data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape

from ..presentation.tables import SummaryTable, tabulate
from ..results.comparison import Difference
from ..results.contrasts import Contrasts


@dataclass(frozen=True)
class Comparison:
    """Conditions compared by one measure; printed or shown by a notebook, table and verdicts."""

    contrasts: Contrasts
    """The analysis."""

    @cached_property
    def table(self) -> SummaryTable:
        """Estimates and differences, in all forms."""
        return tabulate(self.contrasts.table)

    @property
    def differences(self) -> tuple[Difference, ...]:
        """Every difference with its interval, and p raw and adjusted."""
        return self.contrasts.differences

    @property
    def verdicts(self) -> tuple[str, ...]:
        """What was found, and what could have been detected, line by line."""
        return self.contrasts.notes

    def __str__(self) -> str:
        return "\n".join([str(self.table), "", *self.verdicts])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        lines = "\n".join(map(escape, self.verdicts))
        return f"{self.table.html}<pre>{lines}</pre>"
