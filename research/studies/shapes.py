"""The shapes study: whether the shape of the box is indifferent, as the paper has it.

A team is trained with one box, and then acts greedily, without any further learning, with every box
that the spec lists under ``[evaluations]``, on the same worlds. What is reported of each box is its
success rate, and the ratio to the rate with the box of training. The agents' state holds nothing of
the shape; the predictor by which they look ahead is given it (see docs/dynamics_models.md).
"""

import numpy as np

from nested_agents import Analysis, Spec, Study, Summary, bootstrap, rate
from nested_agents.analysis import (
    EVALUATED,
    Difference,
    Figures,
    Results,
    adjust,
    format_estimate,
    format_p,
    power_lines,
    ratio,
)
from nested_agents.study import check_evaluations

TRAINED = "trained on"
"""How the box of training is called among the others."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there is another box to compare with."""
    check_evaluations(spec, 'circle.box = "circle"')


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling.

    Ratios are the cases: by condition, p of no difference, adjusted over its boxes.
    """
    conditions = results.of_phase("evaluation")
    ratios = [(condition, ratios_of(results, condition)) for condition in conditions]
    table = []
    notes = []
    for condition, compared in ratios:
        by_box = {d.condition: d.estimate for d in compared}
        own = 1.0 if results.success(condition, "evaluation").any() else np.nan
        for box, phase in ({TRAINED: "evaluation"} | results.other_evaluations(condition)).items():
            label = box if len(ratios) == 1 else f"{condition}: {box}"
            success = results.success(condition, phase)
            estimates = {EVALUATED: rate(success), "ratio": by_box.get(box, bootstrap([own]))}
            if results.has(condition, phase, "contact_fraction"):
                shares = results.values(condition, "contact_fraction", phase).mean(axis=1)
                estimates["contact"] = bootstrap(shares, bounds=(0, 1))
            table.append(Summary(label, len(success), estimates))
        if compared:
            notes.append(f"\n{condition}, ratio to the box of training:")
            for d in compared:
                shown = format_estimate(d.estimate)
                notes.append(f"  {d.condition}: {shown}, p {format_p(d.p)} (adjusted)")
            samples = [d.sample for d in compared]
            notes += power_lines(samples, len(samples), title="evaluation success")
    return Analysis(tuple(table), tuple(notes), ratios)


def ratios_of(results: Results, condition: str) -> tuple[Difference, ...]:
    """Return the ratios of a condition, box by box; none if it has not been evaluated."""
    if not results.has(condition, "evaluation"):
        return ()
    base = results.success(condition, "evaluation")
    pairs = []
    for box, phase in results.other_evaluations(condition).items():
        outcomes = results.success(condition, phase)
        estimate = ratio(outcomes, base)
        pairs.append((box, "ratio", outcomes.mean(axis=1), base.mean(axis=1), estimate))
    return adjust(pairs)


def draw(analysis: Analysis) -> Figures:
    """Return the figures of an analysis by name."""
    from nested_agents.figures import draw_forest

    unit = "success over that with the box of training"
    return draw_forest("shapes", dict(analysis.cases), unit, null=1.0)


class ShapesStudy(Study):
    """Compares boxes of other shapes than the one of training."""

    check = staticmethod(check)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
