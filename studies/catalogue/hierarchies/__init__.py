"""The hierarchies study: which hierarchy it takes, at which size, at what cost.

Conditions are topologies, crossed with whose value decides and with the number of robots; all meet
the same worlds, seed by seed. One measure was fixed beforehand: evaluation success, or the return
in tasks in which nothing is one. For each number of robots and each choice of whose value decides,
every hierarchy is compared with the chain (with the first hierarchy if there is no chain) by
permutation of signs; p is adjusted by Holm's method over all of these comparisons. Few seeds cannot
give a small p whatever the outcome: how many it takes is printed.

A trial is measured as one of the scaling study, messages included: one for every edge of the
hierarchy's transitive closure. Decisions to the goal are those of successful episodes alone: a
hierarchy that succeeds only where it is easy looks quick.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import SpecError
from ...results.analysis import (
    EVALUATED,
    NOTHING,
    Analysis,
    Figures,
    Summary,
    estimate_of,
    judged,
    steps_estimate,
)
from ...results.differences import Pair
from ...results.results import Results
from ...results.sizes import Sizes
from ...results.statistics import NOT_NEGATIVE, Array, Estimate, bootstrap, exactly
from ...spec.spec import Spec
from ...spec.tables import label_but
from ..scaling import NUMBERS, measure
from ..study import check_evaluated, distinct
from .cases import HierarchyCase

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
VALUE_OF = "learner.decision.value_of"
"""What is swept to vary whose value decides."""
REFERENCE = "chain"
"""The hierarchy that others are compared with, if it is there."""
DECIDING = "decision [ms]"
"""Title of the time that a decision takes."""
MESSAGES = (
    "Messages: decisions communicated. Broadcast states, which predictors use, are not counted."
)


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there are hierarchies to compare and episodes to compare them by."""
    check_evaluated(spec)
    settings = [condition.settings for condition in spec.conditions()]
    if len({(one.agents, one.topology.model_dump_json()) for one in settings}) < 2:
        raise SpecError(
            f"topology = {settings[0].topology.title!r} in every condition: hierarchies needs two "
            "or more, sweep topology"
        )


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling.

    Cases are sorted by number of robots, whose value decides, and hierarchy. Times are of one
    decision of the whole team.
    """
    conditions = results.of_phase("evaluation")
    sizes = Sizes.of(results, conditions)
    cases = []
    apart = (VALUE_OF, *sizes.keys)
    for condition, robots in sizes.counts.items():
        columns = results.columns.get(condition, {"name": condition})
        hierarchy = label_but(columns, apart)
        value_of = str(columns.get(VALUE_OF, ""))
        numbers = results.numbers(condition)
        values = estimates(
            results, condition, "evaluation", numbers["decision_median"], numbers["messages"]
        )
        cases.append(HierarchyCase(condition, hierarchy, value_of, robots, sizes, values))
    return analysis_of(results, cases, REFERENCE)


def analysis_of(results: Results, cases: Sequence[HierarchyCase], reference: str) -> Analysis:
    """Compare cases with those of the reference hierarchy; of the first one if it is missing."""
    whose = distinct(case.value_of for case in cases)
    cases = sorted(cases, key=lambda case: (case.robots, whose.index(case.value_of)))
    table = [Summary(c.label, len(results.seeds(c.condition)), c.values) for c in cases]
    if not cases:
        return Analysis(())
    hierarchies = [case.hierarchy for case in cases]
    reference = reference if reference in hierarchies else hierarchies[0]
    main = results.main
    title = f"evaluation {main.heading}"
    means = [results.means(case.condition, case.phase, main.name) for case in cases]
    bases = {c.setting: m for c, m in zip(cases, means, strict=True) if c.hierarchy == reference}
    pairs: dict[str, list[Pair]] = {setting: [] for setting in bases}
    for case, own in zip(cases, means, strict=True):
        if case.setting in bases and case.hierarchy != reference:
            pairs[case.setting].append((case.hierarchy, title, own, bases[case.setting]))
    judgement, lines = judged(pairs, reference, main, title)
    compared = {setting: own for setting, own in judgement.items() if own}
    notes = ["Rows: what else is swept, hierarchy."] * any(case.value_of for case in cases)
    return Analysis(tuple(table), (*notes, MESSAGES, "", *(lines or [NOTHING])), cases, compared)


def estimates(
    results: Results, condition: str, phase: str, deciding: Array, messages: Array
) -> dict[str, Estimate]:
    """Return by title `Results.main`, decisions to the goal, time of a decision [s], messages."""
    success = results.success(condition, phase)
    main = results.main
    values = {f"evaluation {main.heading}": estimate_of(results, condition, phase, main)}
    decisions = to_the_goal(success, results.values(condition, "steps", phase))
    if len(decisions):
        values["decisions to goal"] = steps_estimate(decisions, results.steps(phase))
    values[DECIDING] = bootstrap(1e3 * deciding, bounds=NOT_NEGATIVE)
    values["messages"] = exactly(messages[0])
    return values


def to_the_goal(success: Array, steps: Array) -> Array:
    """Return the mean decisions of successful episodes, of each seed that has any.

    Examples
    --------
    >>> to_the_goal(np.array([[1, 0], [0, 0]]), np.array([[30, 200]] * 2))
    array([30.])
    """
    runs = zip(success.astype(bool), steps, strict=True)
    return np.array([run[reached].mean() for reached, run in runs if reached.any()])


def _draw_dots(cases: Sequence[HierarchyCase]) -> "Figure":
    """Draw success and messages of a decision of one size, a row for every hierarchy."""
    from ...presentation import figures

    main = next(iter(cases[0].values))
    rows = distinct(case.hierarchy for case in cases)
    whose = distinct(case.value_of for case in cases)
    offsets = figures.beside(len(whose))
    figure, panels = figures.panels(1, 2, (7.2, 1.3 + 0.36 * len(rows)), sharey=True)
    for axes, title in zip(panels[0], (main, "messages"), strict=True):
        for case in cases:
            i = whose.index(case.value_of)
            row = rows.index(case.hierarchy) + offsets[i]
            colour = figures.COLOURS[i]
            figures.draw_row(
                axes, row, case.values[title], color=colour, marker=figures.marker(i), markersize=5
            )
        axes.set_xlabel(title)
        axes.grid(axis="x", alpha=0.25)
    if main == EVALUATED:
        figures.as_rates(panels[0, 0], "x")
    figures.name_rows(panels[0, 0], rows)
    if len(whose) > 1:
        names = [f"value of: {value_of}" for value_of in whose]
        figures.name_points(figure, names, "means over seeds, bars: 95% intervals")
    return figure


def draw(analysis: Analysis) -> Figures:
    """Return the figure: success and time of a decision by number of robots.

    Of one size it is a chart of success and messages, with a row for each hierarchy. Otherwise
    there is a column of panels for each choice of whose value decides. Points are means over seeds,
    bars their 95% intervals; hierarchies differ by colour and marker, and stand a little beside
    each other.
    """
    from ...presentation import figures  # matplotlib takes its time

    cases = analysis.cases
    if len({case.robots for case in cases}) == 1:
        return {"hierarchies": _draw_dots(cases)}
    main = next(iter(cases[0].values))
    hierarchies = distinct(case.hierarchy for case in cases)
    whose = distinct(case.value_of for case in cases)
    size = (max(5.6, 0.6 + 2.8 * len(whose)), 5.2)
    figure, panels = figures.panels(2, len(whose), size, sharex=True, sharey="row")
    for column, value_of in zip(panels.T, whose, strict=True):
        for index, hierarchy in enumerate(hierarchies):
            own = [c for c in cases if (c.hierarchy, c.value_of) == (hierarchy, value_of)]
            for axes, title in zip(column, (main, DECIDING), strict=True):
                robots = [case.robots for case in own]
                values = [case.values[title] for case in own]
                if own:
                    figures.draw_line(axes, robots, values, index, len(hierarchies))
        column[0].set_title(f"value of: {value_of}" if value_of else "", loc="left")
        column[1].set_xlabel(cases[0].sizes.word)
    for axes in panels.flat:
        figures.scale_axis(axes, sorted({case.robots for case in cases}))
    if main == EVALUATED:
        figures.as_rates(panels[0, 0])
    figures.log_axis(panels[1, 0])
    for axes, title in zip(panels[:, 0], (main, "deciding [ms]"), strict=True):
        axes.set_ylabel(title)
    figures.name_lines(figure, hierarchies, "means over seeds, bars: 95% intervals")
    return {"hierarchies": figure}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
