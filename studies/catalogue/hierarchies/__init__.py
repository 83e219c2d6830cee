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

import numpy as np

from ...errors import SpecError
from ...results.analysis import (
    NOTHING,
    Analysis,
    Figures,
    Summary,
    estimate_of,
    judged,
    left_out_lines,
    steps_estimate,
)
from ...results.differences import Pair
from ...results.notation import listed
from ...results.results import Results
from ...results.sizes import Sizes
from ...results.statistics import NOT_NEGATIVE, Array, Estimate, bootstrap, exactly
from ...spec.spec import Spec
from ...spec.tables import label_but
from ..scaling import NUMBERS, measure
from ..sized import SizedCase, draw_by_size
from ..study import check_evaluated, distinct

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
        cases.append(SizedCase(condition, hierarchy, value_of, robots, sizes, values))
    return analysis_of(results, cases, REFERENCE)


def analysis_of(results: Results, cases: Sequence[SizedCase], reference: str) -> Analysis:
    """Compare cases with the reference hierarchy, or with the first if it is missing."""
    groups = distinct(case.group for case in cases)
    cases = sorted(cases, key=lambda case: (case.robots, groups.index(case.group)))
    table = [Summary(c.label, len(results.seeds(c.condition)), c.values) for c in cases]
    if not cases:
        return Analysis(())
    hierarchies = [case.name for case in cases]
    reference = reference if reference in hierarchies else hierarchies[0]
    main = results.main
    title = f"evaluation {main.heading}"
    means = [results.means(case.condition, case.phase, main.name) for case in cases]
    bases = {c.setting: m for c, m in zip(cases, means, strict=True) if c.name == reference}
    pairs: dict[str, list[Pair]] = {setting: [] for setting in bases}
    for case, own in zip(cases, means, strict=True):
        if case.setting in bases and case.name != reference:
            pairs[case.setting].append((case.name, title, own, bases[case.setting]))
    judgement, lines = judged(pairs, reference, main, title)
    compared = {setting: own for setting, own in judgement.items() if own}
    others = distinct(case.setting for case in cases if case.setting not in bases)
    lines += listed(f"Not compared, because {reference} is missing", others)
    notes = ["Rows: setting, hierarchy."] * any(case.group for case in cases)
    notes += left_out_lines(results, "evaluation")
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


def draw(analysis: Analysis) -> Figures:
    """Return the figure: evaluation, decision time and messages against the number of robots."""
    titles = [analysis.cases[0].main, DECIDING, "messages"]
    return {"hierarchies": draw_by_size(analysis.cases, titles)}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
