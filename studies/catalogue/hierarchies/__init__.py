"""Hierarchies study: success and cost of hierarchies at several team sizes.

Conditions are topologies, crossed with the value that decides and with the number of robots. They
share initial states by seed. The measure is evaluation success, or the return in tasks without a
success. In each setting, every hierarchy is compared with the chain (with the first hierarchy if
there is no chain) by permutation of signs; p-values are adjusted by Holm's method over all
comparisons. The notes say how many seeds a small p-value needs.

Trials are measured as in the scaling study. The number of messages is that of the edges in the
transitive closure of the hierarchy. Decisions to the goal include successful episodes only, so
they favor hierarchies that succeed only in easy episodes.
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
"""Key that is swept to vary the value that decides."""
REFERENCE = "chain"
"""Reference of comparisons, if it is among the hierarchies."""
DECIDING = "decision [ms]"
"""Title of the time of a decision."""
MESSAGES = "Messages: communicated decisions, without the states broadcast for prediction."


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there are two hierarchies and evaluation episodes."""
    check_evaluated(spec)
    settings = [condition.settings for condition in spec.conditions()]
    if len({(one.agents, one.topology.model_dump_json()) for one in settings}) < 2:
        raise SpecError(
            f"topology = {settings[0].topology.title!r} in every condition: hierarchies needs two "
            "or more, sweep topology"
        )


def analyse(results: Results) -> Analysis:
    """Estimate and compare evaluation results, with seeds as the unit of sampling.

    Cases are sorted by number of robots, value that decides, and hierarchy. Times are those of one
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
    """Compare cases with the reference hierarchy, or with the first if it is missing."""
    values_of = distinct(case.value_of for case in cases)
    cases = sorted(cases, key=lambda case: (case.robots, values_of.index(case.value_of)))
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
    notes = ["Rows: setting, hierarchy."] * any(case.value_of for case in cases)
    return Analysis(tuple(table), (*notes, MESSAGES, "", *(lines or [NOTHING])), cases, compared)


def estimates(
    results: Results, condition: str, phase: str, deciding: Array, messages: Array
) -> dict[str, Estimate]:
    """Return estimates of `Results.main`, decisions to the goal, decision time and messages."""
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
    """Return the mean number of decisions of successful episodes, for seeds that have any.

    Examples
    --------
    >>> to_the_goal(np.array([[1, 0], [0, 0]]), np.array([[30, 200]] * 2))
    array([30.])
    """
    runs = zip(success.astype(bool), steps, strict=True)
    return np.array([run[reached].mean() for reached, run in runs if reached.any()])


def _draw_dots(cases: Sequence[HierarchyCase]) -> "Figure":
    """Draw success and messages for one team size, with a row for every hierarchy."""
    from ...presentation import figures

    main = next(iter(cases[0].values))
    rows = distinct(case.hierarchy for case in cases)
    values_of = distinct(case.value_of for case in cases)
    offsets = figures.beside(len(values_of))
    figure, panels = figures.panels(1, 2, (7.2, 1.3 + 0.36 * len(rows)), sharey=True)
    for axes, title in zip(panels[0], (main, "messages"), strict=True):
        for case in cases:
            i = values_of.index(case.value_of)
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
    if len(values_of) > 1:
        names = [f"value of: {value_of}" for value_of in values_of]
        figures.name_points(figure, names, "means over seeds, bars: 95% intervals")
    return figure


def draw(analysis: Analysis) -> Figures:
    """Return the figure: success and decision time against the number of robots.

    For a single size it is a chart of success and messages with a row for each hierarchy. Otherwise
    it has a column of panels for each value that decides. Points are means over seeds with 95%
    intervals; hierarchies differ by color and marker and are slightly offset.
    """
    from ...presentation import figures  # matplotlib takes its time

    cases = analysis.cases
    if len({case.robots for case in cases}) == 1:
        return {"hierarchies": _draw_dots(cases)}
    main = next(iter(cases[0].values))
    hierarchies = distinct(case.hierarchy for case in cases)
    values_of = distinct(case.value_of for case in cases)
    size = (max(5.6, 0.6 + 2.8 * len(values_of)), 5.2)
    figure, panels = figures.panels(2, len(values_of), size, sharex=True, sharey="row")
    for column, value_of in zip(panels.T, values_of, strict=True):
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
