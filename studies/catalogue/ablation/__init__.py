"""The ablation study: what each ingredient of the default contributes.

The first condition is the reference; every other one differs from it in one ingredient, removed or
replaced. All meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a
team learns (success over all of training) and how well it ends (evaluation success).
The differences are tested by permutation of signs, and p is adjusted by Holm's method over all
conditions and both measures.
"""

from __future__ import annotations

import numpy as np

from ...results.analysis import Analysis, Figures
from ...results.comparison import differences, mean_success, with_first
from ...results.results import Results
from ...results.statistics import Estimate, rate
from ...results.summary import EVALUATED, Summary
from ...results.verdicts import power_lines, verdict_lines
from ..study import run_training as measure

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
PHASES = {"training success": "training", EVALUATED: "evaluation"}
"""The measures: success rates in these phases."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("training")
    phases = {title: phase for title, phase in PHASES.items() if phase in results.phases}
    measures = {title: mean_success(phase) for title, phase in phases.items()}
    compared = differences(results, with_first(conditions), measures)
    by_place = {(d.condition, d.measure): d.estimate for d in compared}
    unknown = Estimate(*(np.asarray(value) for value in (0.0, np.nan, np.nan)))
    table = []
    for condition in conditions:
        estimates = {}
        for title, phase in phases.items():
            estimates[title] = rate(results.success(condition, phase))
            estimates[f"{title}, difference"] = by_place.get((condition, title), unknown)
        table.append(Summary(condition, len(results.seeds(condition)), estimates))
    notes = []
    for title in dict.fromkeys(d.measure for d in compared):
        notes.append(f"\n{title}, p adjusted over {len(compared)} comparisons:")
        notes += verdict_lines([d for d in compared if d.measure == title])
    return Analysis(
        tuple(table), (*notes, *power_lines(compared)), tuple(phases), differences=compared
    )


def draw(analysis: Analysis) -> Figures:
    """Return the figures of an analysis by name."""
    from ...presentation import forest

    panels = {
        title: [d for d in analysis.differences if d.measure == title] for title in analysis.cases
    }
    figure = forest.draw(panels, "difference from the first condition")
    return {} if figure is None else {"ablation": figure}


__all__ = ["analyse", "draw", "measure"]
