"""Scalability of a study: table, laws, paragraph and figure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

from ..errors import SpecError
from ..laws.size_axis import SizeAxis
from ..laws.universal import Scaling
from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.notation import wrapped
from ..results.results import Results
from ..results.statistics import plain
from ..spec.conditions import ConditionSettings
from .analysis import Scalability
from .data import collect

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ASSUMED = (
    "The scenario does not say whether its task grows with the team: strong scaling is assumed. "
    "Set it with --scaling strong or --scaling weak."
)


REMARK = (
    "Speed-up, efficiency and serial fraction have Fieller intervals, other columns those of the "
    "study's table."
)


@dataclass(frozen=True, repr=False)
class ScalabilityReport(Report):
    """Scalability of hierarchies and their costs; printed or shown by a notebook."""

    analysis: Scalability
    remarks: tuple[str, ...] = ()

    @property
    def table(self) -> SummaryTable:
        """Performance, speed-up, efficiency, serial fraction and costs by hierarchy and size."""
        return tabulate(self.analysis.summaries, remark=REMARK)

    @property
    def laws(self) -> SummaryTable:
        """Contention, coherency and best size of the universal scalability law by hierarchy."""
        return tabulate(self.analysis.law_summaries, remark=REMARK)

    @property
    def tables(self) -> tuple[SummaryTable, ...]:
        """The table of hierarchies and sizes, and that of laws if there are any."""
        return (self.table, self.laws) if self.analysis.laws else (self.table,)

    @property
    def notes(self) -> tuple[str, ...]:
        """The findings as a paragraph, in lines, and remarks."""
        return tuple(
            line for text in (self.analysis.paragraph, *self.remarks) for line in wrapped(text)
        )

    @property
    def json(self) -> str:
        """Everything as JSON."""
        return json.dumps(plain(self.analysis.to_dict() | {"remarks": self.remarks}), indent=1)

    def figure(self) -> Figure:
        """Return four panels: performance, efficiency, a cost, and performance against the cost."""
        from .figure import draw  # matplotlib takes its time

        return draw(self.analysis)


def analyze(
    results: Results,
    settings: Mapping[str, ConditionSettings],
    measure: str | None,
    size: str | None,
    scaling: Scaling | None,
    criterion: float | None,
    budget: str,
) -> ScalabilityReport:
    """Return the report of results with the settings of their conditions, see `StudyResults`."""
    if scaling not in (None, *get_args(Scaling)):
        raise SpecError(f"scaling = {scaling!r}: allowed are {', '.join(get_args(Scaling))}")
    by_scenario = _scaling_of(results, settings, size)
    data = collect(
        results,
        scaling or by_scenario or "strong",
        measure=results.main.name if measure is None else measure,
        size=size,
        criterion=criterion,
    )
    analysis = Scalability(data, budget)
    _ = analysis.choices  # a wrong budget is refused before anything is printed
    return ScalabilityReport(analysis, () if scaling or by_scenario else (ASSUMED,))


def _scaling_of(
    results: Results, settings: Mapping[str, ConditionSettings], size: str | None
) -> Scaling | None:
    """Return whether the task grows with the team; None if the scenario does not say."""
    places = SizeAxis.of(results, size).places
    sizes: dict[float, set[float | None]] = {}
    for condition, own in settings.items():
        if condition in places:
            sizes.setdefault(places[condition][1], set()).add(own.scenario.task_size)
    known: Sequence[float | None] = [part for each in sizes.values() for part in each]
    if not known or None in known:
        return None
    return "weak" if len(set(known)) > 1 else "strong"
