"""The ablation study: what each ingredient of the default contributes.

The first condition is the reference; every other one differs from it in one ingredient, removed or
replaced. All meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a
team learns (success over all of training) and how well it ends (evaluation success).
The differences are tested by permutation of signs, and p is adjusted by Holm's method over all
conditions and both measures.
"""

from collections.abc import Sequence

from ...results.analysis import Analysis, Figures
from ...results.comparison import differences, mean_success, phases_of, with_first
from ...results.results import Results
from ...results.statistics import exactly, rate
from ...results.summary import Summary
from ...results.verdicts import by_measure, verdicts
from ..study import run_training as measure

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    return compared_with_first(results, results.of_phase("training"))


def compared_with_first(results: Results, names: Sequence[str]) -> Analysis:
    """Return the analysis with conditions under these names, as many as have been trained."""
    conditions = results.of_phase("training")
    phases = phases_of(results)
    measures = {title: mean_success(phase) for title, phase in phases.items()}
    compared = differences(results, with_first(conditions, names), measures)
    by_place = {(d.condition, d.measure): d.estimate for d in compared}
    table = []
    for condition, name in zip(conditions, names, strict=True):
        estimates = {}
        for title, phase in phases.items():
            estimates[title] = rate(results.success(condition, phase))
            estimates[f"{title}, difference"] = by_place.get((name, title), exactly(0.0))
        table.append(Summary(name, len(results.seeds(condition)), estimates))
    notes = verdicts(compared, names[0]) if compared else []
    return Analysis(tuple(table), tuple(notes), differences=compared)


def draw(analysis: Analysis) -> Figures:
    """Return the figures of an analysis by name."""
    from ...presentation import forest

    figure = forest.draw(by_measure(analysis.differences), "difference from the first condition")
    return {} if figure is None else {"ablation": figure}


__all__ = ["analyse", "draw", "measure"]
