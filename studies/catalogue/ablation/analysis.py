"""The ablation study: what each ingredient of the default contributes.

The first condition is the reference; every other one differs from it in one ingredient, removed or
replaced. All meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a
team learns (success over all of training) and how well it ends (evaluation success).
The differences are tested by permutation of signs, and p is adjusted by Holm's method over all
conditions and both measures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...results.comparison import Difference, differences
from ...results.results import Results
from ...results.statistics import Estimate, rate
from ...results.summary import EVALUATED, Summary
from ...results.verdicts import power_lines, told

PHASES = {"training success": "training", EVALUATED: "evaluation"}
"""The measures: success rates in these phases."""


@dataclass(frozen=True)
class Ablation:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition, the reference first.
    differences
        Of every other condition from the reference, by each measure.
    notes
        What was found to matter, for printing.
    """

    table: tuple[Summary, ...]
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]


def analyse(results: Results) -> Ablation:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = list(results.training)
    measures = {
        title: lambda r, condition, phase=phase: r.phases[phase][condition]["success"].mean(axis=1)
        for title, phase in PHASES.items()
        if phase in results.phases
    }
    found: tuple[Difference, ...] = ()
    if conditions:
        found = differences(results, conditions[0], conditions[1:], measures)
    by_place = {(d.condition, d.measure): d.estimate for d in found}
    unknown = Estimate(*(np.asarray(value) for value in (0.0, np.nan, np.nan)))
    table = []
    for condition in conditions:
        estimates = {}
        for title in measures:
            estimates[title] = rate(results.phases[PHASES[title]][condition]["success"])
            estimates[f"{title}, difference"] = by_place.get((condition, title), unknown)
        table.append(Summary(condition, len(results.seeds[condition]), estimates))
    return Ablation(tuple(table), found, tuple(_notes(found)))


def _notes(found: tuple[Difference, ...]) -> list[str]:
    lines = []
    for title in dict.fromkeys(d.measure for d in found):
        lines.append(f"\n{title}, p adjusted over {len(found)} comparisons:")
        lines += told([d for d in found if d.measure == title])
    return [*lines, *power_lines(found)]
