"""Laws of growth of a study: a table, sentences and a figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING

from ...core.plugins.words import expect, expect_each
from ..laws import scaling
from ..presentation.reports import Report
from ..presentation.tables import SummaryTable, tabulate
from .search_methods import method_remarks
from .study import StudyResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Growth(Report):
    """Growth of a measure with size; printed, it is a table with sentences."""

    analysis: scaling.ScalingLaw
    """The laws, group by group."""

    @property
    def table(self) -> SummaryTable:
        """Exponents, what else a law has, and predictions, in all forms."""
        return tabulate(self.analysis.table)

    @property
    def notes(self) -> tuple[str, ...]:
        """Chosen laws, their predictions of sizes that were left out, differences of exponents."""
        return self.analysis.notes

    def figure(self) -> Figure:
        """Return what was measured, the laws and their 90% predictions."""
        from ..presentation.growth import draw_laws  # matplotlib takes its time

        return draw_laws(self.analysis)


def scaling_law(
    study: StudyResults,
    measure: str | None = None,
    *,
    phase: str | None = None,
    size: str | None = None,
    criterion: float | None = None,
    predict: Sequence[int] = (),
) -> Growth:
    """Fit how a measure of a study grows with the size of its teams.

    Parameters
    ----------
    study
        Loaded results with a swept key of numbers as the size.
    measure
        Of episodes, ``steps``, ``return`` or a number of whole trials, by name; by default the
        first, which is success, or the return where nothing is one.
    phase
        Phase of the episodes; by default the one that ``compare`` takes.
    size
        The swept key, or its last part, as ``robots``; by default the number of robots or agents.
    criterion
        Fit the decisions of training until this share of five episodes in a row succeeds.
    predict
        Further sizes to predict: the mean of as many seeds, with its 90% interval.

    Raises
    ------
    SpecError
        If there is no such measure, phase or size.
    """
    expect("what load or run returned", StudyResults, study=study)
    expect_each("whole numbers", Integral, predict=predict)
    results = study.results_by_size(size)
    name = results.main.name if measure is None else measure
    law = scaling.scaling_law(
        results, name, phase=phase, size=size, criterion=criterion, predict=predict
    )
    with study._sources.active():
        remarks = method_remarks(study.condition_settings(), results, size, predict)
    return Growth(law._replace(remarks=remarks))
