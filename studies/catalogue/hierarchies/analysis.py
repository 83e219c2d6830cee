"""The hierarchies study: which hierarchy it takes, at which size, at what cost.

Conditions are topologies, crossed with whose value decides and with the number of robots; all meet
the same worlds, seed by seed. One measure was fixed beforehand: evaluation success. For each number
of robots and each choice of whose value decides, every hierarchy is compared with the chain (with
the first hierarchy if there is no chain) by permutation of signs; p is adjusted by Holm's method
over all of these comparisons. Few seeds cannot give a small p whatever the outcome: what they
leave undecided is called so, and how many seeds it takes is said.

A trial is measured as one of the scaling study, messages included: one for every edge of the
hierarchy's transitive closure. Decisions to the goal are those of successful episodes alone: a
hierarchy that succeeds only where it is easy looks quick.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from textwrap import wrap
from typing import ClassVar

import numpy as np

from ...results.comparison import Array, Difference, adjusted, difference, paired
from ...results.paired_tests import LEVEL
from ...results.power import seeds_needed
from ...results.results import Arrays, Results
from ...results.statistics import Estimate, bootstrap, rate
from ...results.summary import EVALUATED, Summary, two_figures
from ...results.verdicts import power_lines
from ...spec.errors import SpecError
from ...spec.labels import label_but
from ...spec.spec import Spec

VALUE_OF = "learner.decision.value_of"
"""What is swept to vary whose value decides."""
REFERENCE = "chain"
"""The hierarchy that others are compared with, if it is there."""
WIDTH = 80
"""Of a note [characters]."""
DECIDING, MESSAGES = "decide [ms]", "messages"
"""Titles of what a decision costs."""
UNBROKEN = "\N{NO-BREAK SPACE}"


def check(spec: Spec) -> None:
    """Raise `SpecError` unless there are hierarchies to compare and episodes to compare them by."""
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: hierarchies compares evaluation success, needs 1 or more")
    settings = [condition.settings for condition in spec.conditions()]
    if len({(one.agents, one.topology.model_dump_json()) for one in settings}) < 2:
        raise SpecError(
            f"topology = {settings[0].topology.title!r} in every condition: hierarchies needs two "
            "or more, sweep topology"
        )


@dataclass(frozen=True)
class Case:
    """One condition.

    Attributes
    ----------
    condition
        Its label.
    hierarchy
        Its label without the number of robots and whose value decides.
    value_of
        Whose value decides; empty if that is not swept.
    robots
        Their number.
    values
        Estimates by title.
    """

    condition: str
    hierarchy: str
    value_of: str
    robots: int
    values: dict[str, Estimate]

    @property
    def setting(self) -> str:
        """What it has in common with those that it is compared with."""
        counted = f"{self.robots} robot{'s' * (self.robots != 1)}"
        return f"{counted}, {self.value_of}" if self.value_of else counted


@dataclass(frozen=True)
class Verdict:
    """Whether the hierarchy matters, given the number of robots and whose value decides.

    Attributes
    ----------
    setting
        Those two.
    reference
        The hierarchy that the others are compared with.
    comparisons
        Every other hierarchy less the reference, by evaluation success.
    among
        How many comparisons of the study p is adjusted over.
    """

    setting: str
    reference: str
    comparisons: tuple[Difference, ...]
    among: int

    @property
    def different(self) -> tuple[Difference, ...]:
        """Those that differ significantly."""
        return tuple(d for d in self.comparisons if d.p < LEVEL)

    @property
    def undecided(self) -> tuple[Difference, ...]:
        """Those of too few seeds, and those whose interval leaves out 0 though p is too large."""
        needed = seeds_needed(self.among)
        return tuple(
            d
            for d in self.comparisons
            if d.p >= LEVEL and (d.seeds < needed or not d.estimate.low <= 0.0 <= d.estimate.high)
        )

    @property
    def alike(self) -> tuple[Difference, ...]:
        """Those in which no difference was found, though there are seeds enough to find one."""
        rest = (*self.different, *self.undecided)
        return tuple(d for d in self.comparisons if d not in rest)


@dataclass(frozen=True)
class Hierarchies:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition, by number of robots, whose value decides, and hierarchy.
    cases
        The same for figures.
    verdicts
        Where the hierarchy matters.
    notes
        Those, for printing.
    """

    table: tuple[Summary, ...]
    cases: tuple[Case, ...]
    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...]
    headline: ClassVar[str] = EVALUATED


def analyse(results: Results) -> Hierarchies:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling.

    Times are of one decision of the whole team.
    """
    cases = _cases(results)
    table = tuple(
        Summary(f"{c.setting}, {c.hierarchy}", len(results.seeds[c.condition]), c.values)
        for c in cases
    )
    verdicts = _verdicts(results, cases)
    notes = (*_legend(cases), *_told(verdicts), *_highest(cases))
    return Hierarchies(table, cases, verdicts, notes)


def _cases(results: Results) -> tuple[Case, ...]:
    robots = {c: int(results.numbers[c]["robots"][0]) for c in results.evaluation}
    apart = (VALUE_OF, *_sizes(results.columns, robots))
    cases = []
    for condition, evaluation in results.evaluation.items():
        columns = results.columns.get(condition, {"name": condition})
        hierarchy, value_of = label_but(columns, apart), str(columns.get(VALUE_OF, ""))
        values = _estimates(evaluation, results.numbers[condition], results.usage[condition])
        cases.append(Case(condition, hierarchy, value_of, robots[condition], values))
    whose = list(dict.fromkeys(case.value_of for case in cases))
    return tuple(sorted(cases, key=lambda case: (case.robots, whose.index(case.value_of))))


def _sizes(columns: Mapping[str, Mapping[str, object]], robots: Mapping[str, int]) -> list[str]:
    """Return the swept keys that are the number of robots, whatever the scenario calls it."""
    keys = dict.fromkeys(key for swept in columns.values() for key in swept)
    return [
        key
        for key in keys
        if all(str(columns.get(c, {}).get(key)) == str(count) for c, count in robots.items())
    ]


def _estimates(evaluation: Arrays, numbers: Arrays, usage: Arrays) -> dict[str, Estimate]:
    values = {EVALUATED: rate(evaluation["success"])}
    decisions = to_the_goal(evaluation)
    if len(decisions):
        values["decisions to goal"] = bootstrap(decisions)
    values[DECIDING] = bootstrap(1e3 * usage["decision_median"])
    unknown = np.asarray(np.nan)  # a count has no interval
    values[MESSAGES] = Estimate(numbers["messages"][0], unknown, unknown)
    return values


def to_the_goal(evaluation: Arrays) -> Array:
    """Return the mean decisions of successful episodes, of each seed that has any.

    Examples
    --------
    >>> to_the_goal({"success": np.array([[1, 0], [0, 0]]), "steps": np.array([[30, 200]] * 2)})
    array([30.])
    """
    runs = zip(evaluation["success"].astype(bool), evaluation["steps"], strict=True)
    return np.array([steps[success].mean() for success, steps in runs if success.any()])


def _verdicts(results: Results, cases: tuple[Case, ...]) -> tuple[Verdict, ...]:
    hierarchies = list(dict.fromkeys(case.hierarchy for case in cases))
    reference = REFERENCE if REFERENCE in hierarchies else next(iter(hierarchies), "")
    found: dict[str, list[Difference]] = {}
    bases = {case.setting: case.condition for case in cases if case.hierarchy == reference}
    for case in cases:
        base = bases.get(case.setting)
        if base is None or base == case.condition:
            continue
        own, other = paired(results, case.condition, base, _outcomes)
        if len(own) >= 2:
            runs = own.mean(axis=1), other.mean(axis=1)
            compared = Difference.of(case.hierarchy, EVALUATED, *runs, difference(own, other))
            found.setdefault(case.setting, []).append(compared)
    compared_all = adjusted([compared for group in found.values() for compared in group])
    following = iter(compared_all)
    return tuple(
        Verdict(setting, reference, tuple(islice(following, len(group))), len(compared_all))
        for setting, group in found.items()
    )


def _outcomes(results: Results, condition: str) -> Array:
    return np.asarray(results.evaluation[condition]["success"], dtype=float)


def _legend(cases: tuple[Case, ...]) -> Iterator[str]:
    if any(case.value_of for case in cases):
        yield "Rows: number of robots, whose value decides, hierarchy."


def _told(verdicts: tuple[Verdict, ...]) -> Iterator[str]:
    """Yield lines that say where the hierarchy matters, and where that is undecided."""
    if not verdicts:
        return
    reference, among = verdicts[0].reference, verdicts[0].among
    text = (
        f"Does the hierarchy matter? Evaluation success less that of {reference}, seed by seed; p "
        f"is adjusted over {among} comparisons, so fewer than {seeds_needed(among)} seeds cannot "
        "tell."
    )
    yield from ("", *wrap(text, WIDTH, break_on_hyphens=False))
    for verdict in verdicts:
        count = f"{len(verdict.different)} of {len(verdict.comparisons)}"
        yield f"{verdict.setting}: {count} found to differ"
        yield from (f"  {d.condition} differs by {d.shown}" for d in verdict.different)
        yield from _listed("no difference found", verdict.alike)
        yield from _listed("cannot be told", verdict.undecided)
    yield from power_lines([d for verdict in verdicts for d in verdict.comparisons])


def _listed(said: str, comparisons: tuple[Difference, ...]) -> Iterator[str]:
    """Yield differences with their intervals as lines, none of which is broken in two."""
    if comparisons:
        shown = [f"{d.condition} {d.shown.rpartition(', ')[0]}" for d in comparisons]
        text = f"  {said}: " + ", ".join(one.replace(" ", UNBROKEN) for one in shown)
        lines = wrap(text, WIDTH, subsequent_indent="    ", break_on_hyphens=False)
        yield from (line.replace(UNBROKEN, " ") for line in lines)


def _highest(cases: tuple[Case, ...]) -> Iterator[str]:
    """Yield a line for every number of robots: the highest success, and what it costs."""
    if cases:
        yield "\nHighest evaluation success, the quickest of equals; what a decision costs:"
    for robots in dict.fromkeys(case.robots for case in cases):
        best = min(
            (case for case in cases if case.robots == robots),
            key=lambda case: (-case.values[EVALUATED].value, case.values[DECIDING].value),
        )
        success, time = (two_figures(float(best.values[t].value)) for t in (EVALUATED, DECIDING))
        passed = f"{best.values[MESSAGES].value:,.0f}"
        yield f"{best.setting}, {best.hierarchy}: {success}; {time} ms, messages {passed}"
