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
from ...spec.tables import SpecTable, label_but
from ...trials.trial import trials_of
from ..scaling import NUMBERS, measure
from ..sized import SizedCase, draw_by_size
from ..study import check_evaluated, distinct

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
VALUE_OF = "learner.decision.value_of"
"""Key that is swept to vary the value that decides."""
REFERENCE = "chain"
"""Reference of comparisons, if it is among the hierarchies."""
DECIDING = "decision time [ms]"
"""Title of the time of a decision."""
MESSAGES = "Messages: communicated decisions; the broadcast of states is not counted."


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there are two hierarchies and evaluation episodes."""
    check_evaluated(spec)
    settings = [condition.settings for condition in spec.conditions()]
    if len({(one.agents, one.topology.model_dump_json()) for one in settings}) < 2:
        raise SpecError(
            f"topology = {settings[0].topology.title!r} in every condition: hierarchies needs two "
            "or more, sweep topology"
        )


def comparisons(spec: Spec) -> int:
    """Return the number of comparisons with the reference in all settings."""
    columns = {condition.label: condition.columns for condition in spec.conditions()}
    trials = trials_of(spec)[: len(columns)]
    counts = {trial.condition: len(trial.world().groups) for trial in trials}
    sizes = Sizes.counted(counts, columns)
    cases = [_case(condition, own, sizes, {}) for condition, own in columns.items()]
    return len(_compared(*_in_order(cases, REFERENCE)))


def _case(
    condition: str, columns: SpecTable, sizes: Sizes, values: dict[str, Estimate]
) -> SizedCase:
    """Return the case of a condition."""
    hierarchy = label_but(columns, (VALUE_OF, *sizes.keys))
    value_of = str(columns.get(VALUE_OF, ""))
    return SizedCase(condition, hierarchy, value_of, sizes.counts[condition], sizes, values)


def _in_order(cases: Sequence[SizedCase], reference: str) -> tuple[list[SizedCase], str]:
    """Return sorted cases, and the reference: the first hierarchy if the given one is missing."""
    groups = distinct(case.group for case in cases)
    cases = sorted(cases, key=lambda case: (case.robots, groups.index(case.group)))
    names = [case.name for case in cases]
    return cases, reference if reference in names else names[0]


def _compared(cases: Sequence[SizedCase], reference: str) -> list[tuple[SizedCase, SizedCase]]:
    """Return the cases that are compared, each with the reference in its setting."""
    bases = {case.setting: case for case in cases if case.name == reference}
    others = (case for case in cases if case.name != reference)
    return [(case, bases[case.setting]) for case in others if case.setting in bases]


def analyse(results: Results) -> Analysis:
    """Estimate and compare evaluation results, with seeds as the unit of sampling.

    Cases are sorted by number of robots, value that decides, and hierarchy. Times are those of one
    decision of the whole team.
    """
    conditions = results.of_phase("evaluation")
    sizes = Sizes.of(results, conditions)
    cases = []
    for condition in conditions:
        columns = results.columns.get(condition, {"name": condition})
        numbers = results.numbers(condition)
        values = estimates(
            results, condition, "evaluation", numbers["decision_median"], numbers["messages"]
        )
        cases.append(_case(condition, columns, sizes, values))
    return analysis_of(results, cases, REFERENCE)


def analysis_of(results: Results, cases: Sequence[SizedCase], reference: str) -> Analysis:
    """Compare cases with the reference hierarchy, or with the first if it is missing."""
    if not cases:
        return Analysis(())
    cases, reference = _in_order(cases, reference)
    table = [Summary(c.label, len(results.seeds(c.condition)), c.values) for c in cases]
    main = results.main
    title = f"evaluation {main.heading}"
    means = {at: results.means(*at, main.name) for at in ((c.condition, c.phase) for c in cases)}
    settings = {case.setting for case in cases if case.name == reference}
    pairs: dict[str, list[Pair]] = {}
    for case, base in _compared(cases, reference):
        own, other = (means[c.condition, c.phase] for c in (case, base))
        pairs.setdefault(case.setting, []).append((case.name, title, own, other))
    judgement, lines = judged(pairs, reference, main, title)
    compared = {setting: own for setting, own in judgement.items() if own}
    others = distinct(case.setting for case in cases if case.setting not in settings)
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


__all__ = ["NUMBERS", "analyse", "check", "comparisons", "draw", "measure"]
