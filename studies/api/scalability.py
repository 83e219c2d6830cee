"""Scalability of a study: table, laws, paragraph and figure."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, get_args

from ...core.plugins.words import expect
from ..errors import SpecError
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Summary
from ..results.notation import wrapped
from ..results.parts import join_sizes
from ..results.scaling_law import columns_of, size_key
from ..scalability.analysis import Scalability
from ..scalability.data import collect
from ..scalability.laws import Scaling
from .growth import condition_settings
from .study import StudyResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ASSUMED = (
    "The scenario does not say whether its task grows with the team: strong scaling is assumed. "
    "The option scaling sets it."
)


class ScalabilityTable(SummaryTable):
    """A table with Student's intervals."""

    @property
    def remark(self) -> str:
        """How the intervals are computed."""
        return "Intervals: Student's over seeds; of ratios to the smallest size, Fieller's."


@dataclass(frozen=True)
class ScalabilityReport:
    """Which hierarchy, how many agents, at which cost; printed or shown by a notebook."""

    analysis: Scalability
    remarks: tuple[str, ...] = ()

    @property
    def table(self) -> SummaryTable:
        """Performance, speed-up, efficiency, serial fraction and costs by hierarchy and size."""
        return _tabulate(self.analysis.summaries)

    @property
    def laws(self) -> SummaryTable:
        """Contention, coherency and best size of the universal scalability law by hierarchy."""
        return _tabulate(self.analysis.law_summaries)

    @property
    def notes(self) -> tuple[str, ...]:
        """The findings as a paragraph, in lines, and remarks."""
        return tuple(
            line for text in (self.analysis.paragraph, *self.remarks) for line in wrapped(text)
        )

    @property
    def json(self) -> str:
        """Everything as JSON."""
        return json.dumps(self.analysis.to_dict() | {"remarks": list(self.remarks)}, indent=1)

    def figure(self) -> Figure:
        """Return four panels: performance, efficiency, a cost, and performance against the cost."""
        from ..scalability.figure import draw  # matplotlib takes its time

        return draw(self.analysis)

    def __str__(self) -> str:
        laws = [str(self.laws), ""] if self.analysis.laws else []
        return "\n".join([str(self.table), "", *laws, *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        notes = "\n".join(map(escape, self.notes))
        laws = self.laws.html if self.analysis.laws else ""
        return f"{self.table.html}{laws}<p>{notes}</p>"


def scalability(
    study: StudyResults,
    measure: str | None = None,
    *,
    size: str | None = None,
    scaling: Scaling | None = None,
    criterion: float | None = None,
    budget: str = "",
) -> ScalabilityReport:
    """Answer which hierarchy scales, up to how many agents, and at which cost.

    Parameters
    ----------
    study
        Loaded results, whose sizes are a swept key of numbers.
    measure
        Measure of performance; by default the first, which is success, or the return where nothing
        is a success.
    size
        The swept key, or its last part, as ``robots``; by default the only one of numbers.
    scaling
        ``strong`` if the task is the same for all sizes, ``weak`` if it grows with the team; by
        default as the scenario says.
    criterion
        Also count the decisions of training until this share of five episodes in a row succeeds.
    budget
        Limits of costs, as ``"messages <= 50, decision_ms <= 100"``.

    Raises
    ------
    SpecError
        If there is only one size, or a cost of the budget was not measured; one line.
    """
    expect("what load or run returned", StudyResults, study=study)
    if scaling not in (None, *get_args(Scaling)):
        raise SpecError(f"scaling = {scaling!r}: allowed are {', '.join(get_args(Scaling))}")
    results = study.results
    if study._tables:
        results = join_sizes(results, study._tables, study._settings, size)
    told = _scaling_of(study, size)
    data = collect(
        results,
        scaling or told or "strong",
        measure=results.main.name if measure is None else measure,
        size=size,
        criterion=criterion,
    )
    analysis = Scalability(data, budget)
    _ = analysis.choices  # a wrong budget is refused before anything is printed
    return ScalabilityReport(analysis, () if scaling or told else (ASSUMED,))


def _tabulate(lines: Sequence[Summary]) -> ScalabilityTable:
    return ScalabilityTable(tabulate(lines).titles, tuple(lines))


def _scaling_of(study: StudyResults, size: str | None) -> Scaling | None:
    """Return whether the task grows with the team; None if the scenario does not say."""
    columns = columns_of(study.results)
    key = size_key(columns, size)
    sizes: dict[float, set[float | None]] = {}
    for condition, settings in condition_settings(study).items():
        if condition in columns:
            n = float(str(columns[condition][key]))
            sizes.setdefault(n, set()).add(settings.scenario.task_size)
    known: Sequence[float | None] = [own for each in sizes.values() for own in each]
    if not known or None in known:
        return None
    return "weak" if len(set(known)) > 1 else "strong"
