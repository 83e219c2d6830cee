"""Scalability of a study: tables, paragraph, figure and JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

from ...core.plugins.words import expect
from ..errors import SpecError
from ..laws.size_axis import SizeAxis
from ..laws.universal import Scaling
from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Summary
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
NOT_PROPORTIONAL = (
    "Speed-ups and efficiencies are left out: they need a task that is the same for all sizes or "
    "grows in proportion to the team. Name such sizes by --where, or set --scaling."
)


REMARK = (
    "Speed-up, efficiency and serial fraction have Fieller intervals, other columns those of the "
    "study's table."
)


@dataclass(frozen=True, repr=False)
class ScalabilityReport(Scalability, Report):
    """Scalability of hierarchies and their costs; printed or shown by a notebook."""

    remarks: tuple[str, ...] = ()

    @property
    def table(self) -> SummaryTable:
        """Performance, speed-up, efficiency, serial fraction and costs by hierarchy and size."""
        return tabulate(self.summaries, remark=REMARK if self.speedups else "")

    @property
    def laws(self) -> SummaryTable:
        """Contention, coherency and best size of the universal scalability law by hierarchy."""
        lines = []
        for name, law in self.universal_laws.items():
            estimates = {"contention": law.contention, "coherency": law.coherency}
            best = law.best_size_within(self.data.sizes(name)[-1])
            estimates |= {f"best number of {self.data.size}": best} if best is not None else {}
            seeds = len(self.data.performances[name, self.data.sizes(name)[0]])
            lines.append(Summary(name, seeds, estimates))
        return tabulate(lines, remark=REMARK)

    @property
    def tables(self) -> tuple[SummaryTable, ...]:
        """The table of hierarchies and sizes, and that of laws if there are any."""
        return (self.table, self.laws) if self.universal_laws else (self.table,)

    @property
    def notes(self) -> tuple[str, ...]:
        """The findings as a paragraph, in lines, and remarks."""
        return tuple(line for text in (self.paragraph, *self.remarks) for line in wrapped(text))

    def figure(self) -> Figure:
        """Return four panels: performance, efficiency, a cost, and performance against the cost."""
        from .figure import draw  # matplotlib takes its time

        return draw(self)

    @property
    def json(self) -> str:
        """Everything as JSON."""
        data = self.data
        best = self.best and (data.all_sizes[-1], *self.best)
        content = {
            "size": data.size,
            "scaling": data.scaling,
            "performance": data.performance_title,
            "rows": [line._asdict() for line in self.summaries],
            "laws": [line._asdict() for line in self.laws.lines],
            "best": best and dict(zip(("size", "hierarchies", "probability"), best, strict=True)),
            "best_sizes": {
                name: {"size": size, "probability": probability}
                for name, (size, probability) in self.best_sizes.items()
            },
            "crossovers": [
                {"better": better, "worse": worse, "size": size}
                for better, worse, size in self.crossovers
            ],
            "fronts": self.fronts.to_dict("records"),
            "budget": self.choices.to_dict("records"),
            "paragraph": self.paragraph,
            "remarks": self.remarks,
        }
        return json.dumps(plain(content), indent=1)


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
    expect("limits of costs, such as 'messages <= 50'", str, budget=budget)
    if scaling not in (None, *get_args(Scaling)):
        raise SpecError(f"scaling = {scaling!r}: allowed are {', '.join(get_args(Scaling))}")
    growth, remark = (scaling, "") if scaling else _scaling_of(results, settings, size)
    data = collect(
        results,
        growth,
        measure=results.main.name if measure is None else measure,
        size=size,
        criterion=criterion,
    )
    report = ScalabilityReport(data, budget, (remark,) if remark else ())
    _ = report.choices  # a wrong budget is refused before anything is printed
    return report


def _scaling_of(
    results: Results, settings: Mapping[str, ConditionSettings], size: str | None
) -> tuple[Scaling | None, str]:
    """Return how the task grows with the team in every group, see `collect`, and a remark."""
    groups = [
        {n: settings[label].scenario.task_size for label, n in sizes.items() if label in settings}
        for sizes in SizeAxis.of(results, size).groups().values()
    ]
    known = [{n: task for n, task in own.items() if task is not None} for own in groups]
    if known != groups or not any(groups):
        return "strong", ASSUMED
    if all(len({*own.values()}) <= 1 for own in known):
        return "strong", ""
    if all(len({round(task / n, 9) for n, task in own.items()}) <= 1 for own in known):
        return "weak", ""
    return None, NOT_PROPORTIONAL
