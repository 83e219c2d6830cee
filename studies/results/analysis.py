"""What a study makes of its results: a table, words about it, and what its figures show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .comparison import Difference
from .summary import Summary


@dataclass(frozen=True)
class Analysis:
    """The analysis of a study.

    Attributes
    ----------
    table
        Its lines, one for each condition or case.
    notes
        Lines that are printed below the table: legend, verdicts, power.
    cases
        What the study's figures are drawn from.
    differences
        What was compared, p adjusted over all.
    headline
        Title of the estimate that a report speaks of first; the table's first one if it has none
        of this title.
    groups
        The lines of the table by what they are compared within, if that is not the whole.
    """

    table: tuple[Summary, ...]
    notes: tuple[str, ...] = ()
    cases: Sequence[Any] = ()
    differences: tuple[Difference, ...] = ()
    headline: str = ""
    groups: Mapping[str, Sequence[Summary]] = field(default_factory=dict)
