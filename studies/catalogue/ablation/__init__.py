"""Ablation study: contribution of each ingredient of the default learner.

The first condition is the reference. Each other condition removes or replaces one ingredient.
Conditions share initial states by seed. The measures are success over training, which reflects the
speed of learning, and evaluation success. Differences are tested by permutation of signs; p-values
are adjusted by Holm's method over all conditions and both measures.
"""

from collections.abc import Sequence

from ...results.analysis import (
    Analysis,
    Figures,
    Summary,
    estimate_of,
    judged,
    left_out_lines,
    phases_of,
)
from ...results.differences import Pair
from ...results.results import Results
from ...results.statistics import exactly
from ...spec.spec import Spec
from ..study import measure as measure

PUBLISHED = ("success",)
"""Measures in published results."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare with 95% intervals, with seeds as the unit of sampling."""
    return compared_with_first(results, results.of_phase("training"))


def comparisons(spec: Spec) -> int:
    """Return the number of comparisons: with the first condition, in training and evaluation."""
    return (len(spec.conditions()) - 1) * (1 + (spec.evaluation > 0))


def compared_with_first(results: Results, names: Sequence[str]) -> Analysis:
    """Return the analysis of the trained conditions under these names."""
    conditions = dict(zip(names, results.of_phase("training"), strict=True))
    phases = phases_of(results)
    main = results.main
    pairs: dict[str, list[Pair]] = {}
    for title, phase in phases.items() if len(conditions) > 1 else ():
        means = {name: results.means(c, phase, main.name) for name, c in conditions.items()}
        pairs[title] = [(name, title, own, means[names[0]]) for name, own in means.items()][1:]
    compared, notes = judged(pairs, "".join(names[:1]), main)
    by_place = {(first, title): exactly(0.0) for first in names[:1] for title in phases}
    by_place |= {(d.condition, d.measure): d.estimate for ds in compared.values() for d in ds}
    table = []
    for name, condition in conditions.items():
        estimates = {}
        for title, phase in phases.items():
            estimates[title] = estimate_of(results, condition, phase, main)
            if (name, title) in by_place:
                estimates[f"{title}, difference"] = by_place[name, title]
        table.append(Summary(name, len(results.seeds(condition)), estimates))
    left_out = left_out_lines(results, "training")
    return Analysis(tuple(table), (*left_out, *notes), differences=compared)


def draw(analysis: Analysis) -> Figures:
    """Return the figures of an analysis by name."""
    from ...presentation.figures import draw_forest

    return draw_forest("ablation", analysis.differences, "difference from the first condition")
