"""Tables, differences and verdicts of a study's results.

Conditions are compared with a reference seed by seed, in the same worlds.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from ..errors import WIDTH
from .differences import MIN_RUNS, Difference, Pair, count_unpaired, differences
from .notation import listed, wrapped
from .permutation_tests import LEVEL
from .power_text import independent_power_lines, power_lines
from .results import STEPS, Results, row_means
from .statistics import NOT_NEGATIVE, Array, Estimate, LowerBound, bootstrap, rate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EVALUATED = "evaluation success"
"""Title of the success of a trained team in the scenario of its condition."""


class Summary(NamedTuple):
    """A line of a table."""

    condition: str
    seeds: int
    """Number of seeds that have finished."""
    estimates: dict[str, Estimate]
    """Scalar estimates by title."""


def has_lower_bounds(lines: Iterable[Summary]) -> bool:
    """Return whether an estimate is only a lower bound."""
    return any(isinstance(e, LowerBound) for line in lines for e in line.estimates.values())


def evaluated(results: Results, condition: str) -> dict[str, Estimate]:
    """Return the evaluations of a condition by title, by `Results.main`.

    Those of ``[evaluations]`` have titles such as ``success, NAME``.
    """
    main = results.main
    if not results.has(condition, "evaluation", main.name):
        return {}
    others = results.other_evaluations(condition).items()
    phases = {
        f"evaluation {main.heading}": "evaluation",
        **{f"{main.heading}, {name}": phase for name, phase in others},
    }
    return {t: estimate_of(results, condition, phase, main) for t, phase in phases.items()}


def estimate_of(
    results: Results, condition: str, phase: str, measure: Measure, part: slice = slice(None)
) -> Estimate:
    """Return the mean of a measure over episodes, or a slice of them, with its interval."""
    shown = results.steps(phase) if measure.name == STEPS.name else measure
    values = results.values(condition, measure.name, phase, part)
    return mean_estimate(shown, pd.DataFrame(values))


def mean_estimate(measure: Measure, values: pd.DataFrame) -> Estimate:
    """Return the mean over seeds of values with a row for each seed."""
    if measure.is_rate and values.notna().all(axis=None):
        return rate(values.to_numpy(dtype=float))
    means = row_means(values).to_numpy()
    if measure.name == STEPS.name:
        return steps_estimate(means, measure)
    return bootstrap(means, bounds=measure.bounds)


def steps_estimate(means: Array, steps: Measure) -> Estimate:
    """Return the mean length of episodes with an interval up to the longest allowed.

    Unlike the interval of a share, it has no width where all episodes are equally long.
    """
    value, low, high = bootstrap(means, bounds=NOT_NEGATIVE)
    return Estimate(value, low, np.minimum(high, steps.bounds[1]))


def phases_of(results: Results) -> dict[str, str]:
    """Return the phases training and evaluation by title, if all trained conditions have them."""
    conditions = results.of_phase("training")
    return {
        f"{phase} {results.main.heading}": phase
        for phase in ("training", "evaluation")
        if all(results.has(condition, phase) for condition in conditions)
    }


UNPAIRED = "Left out of differences, because they have no partner"
"""Beginning of the remark that counts runs by pairs of conditions."""


def left_out_lines(results: Results, phase: str) -> list[str]:
    """Return lines that name the conditions without episodes of a phase."""
    others = [c for c in results.conditions if not results.has(c, phase)]
    return listed(f"Not in the table, because they have no {phase}", others)


Figures: TypeAlias = "dict[str, Figure]"
"""Figures of an analysis by name."""


class Case(NamedTuple):
    """A condition of a study of systems, as its figure shows it."""

    system: str
    """Name of its override."""
    setting: Any
    """Value of its other setting: number of robots, game, exploration."""
    values: Mapping[Any, Estimate]
    """Estimates by title or by number of plays."""


@dataclass(frozen=True)
class Analysis:
    """Analysis of a study."""

    table: tuple[Summary, ...]
    notes: tuple[str, ...] = ()
    """Lines below the table: legend, verdicts, power."""
    cases: Sequence[Any] = ()
    """Data of the study's figures."""
    differences: Mapping[str, Sequence[Difference]] = field(default_factory=dict)
    """Differences by measure or by setting, p adjusted over all."""


NOTHING = "Nothing to compare: no two conditions have two runs each, on common items if any."
TESTS = {
    True: "permutation of signs over seeds",
    False: "permutation of labels of independent samples, with Welch's intervals",
}
"""Names of the tests of paired and of independent samples."""
TWO_TESTS = (
    "Intervals are not adjusted for multiple comparisons; p is adjusted and by permutation. Where "
    "an interval and p seem to disagree about 0, p decides."
)
"""Remark where an interval and p seem to contradict each other."""


def verdict_lines(
    differences: Sequence[Difference], better: str | None = "higher"
) -> Iterator[str]:
    """Yield a line for every difference of one measure, significant ones first.

    `better` says which values are better; if it is None, verdicts are higher or lower.
    """
    words = {"higher": ("worse", "better"), "lower": ("better", "worse"), None: ("lower", "higher")}
    for d in sorted(differences, key=lambda d: (d.p >= LEVEL, float(d.estimate.value))):
        is_higher = bool(d.estimate.value > 0)
        word = words[better][is_higher] if d.p < LEVEL else "no significant difference"
        yield from wrapped(f"{word}: {d.condition}, {d.shown}", "  ")


def verdicts(
    groups: Mapping[str, Sequence[Difference]], measure: Measure = SUCCESS, title: str = ""
) -> list[str]:
    """Return the verdicts of groups by heading, how p is adjusted, and the power, in lines.

    p must be adjusted over all groups. There are no lines if nothing is compared.

    Parameters
    ----------
    groups
        Differences by heading.
    measure
        The measure that is compared.
    title
        Title of the measure in the lines on power, by default that of the differences.
    """
    compared = [d for group in groups.values() for d in group]
    if not compared:
        return []
    lines = []
    for head, group in groups.items():
        if group:
            lines += wrapped(f"{head}:")
            lines += verdict_lines(group, measure.better)
    counted = f"{len(compared)} comparison{'s' * (len(compared) > 1)}"
    tests = [text for paired, text in TESTS.items() if paired in {d.paired for d in compared}]
    lines += wrapped(f"p: {' and '.join(tests)}, adjusted over {counted} (Holm).")
    if any((d.estimate.low > 0.0 or d.estimate.high < 0.0) != (d.p < LEVEL) for d in compared):
        lines += wrapped(TWO_TESTS)
    title = title or " or ".join(dict.fromkeys(d.measure for d in compared))
    samples = [d.sample for d in compared if d.paired]
    independent = [d.values for d in compared if not d.paired]
    lines += power_lines(samples, len(compared), measure, title)
    return lines + independent_power_lines(independent, len(compared), measure, title)


def judged(
    groups: Mapping[str, Iterable[Pair]],
    reference: str,
    measure: Measure = SUCCESS,
    title: str = "",
) -> tuple[dict[str, tuple[Difference, ...]], list[str]]:
    """Return the `differences` of groups, and their `verdicts`.

    Parameters
    ----------
    groups
        Pairs to compare by group.
    reference
        Name of the reference.
    measure
        The measure that is compared.
    title
        Its title in the headings, unless the names of groups contain it.
    """
    pairs = {group: list(own) for group, own in groups.items()}
    compared = differences(pairs, measure)
    heads = {group: ": ".join(filter(None, (group, title))) for group in groups}
    by_head = {f"{heads[g]}, minus that of {reference}": compared[g] for g in groups}
    lines = verdicts(by_head, measure)
    unpaired = dict.fromkeys(
        f"{count} runs of {reference} and {name if group == title else f'{group}, {name}'}"
        for group, each in pairs.items()
        for name, title, own, base in each
        if len(own.index.intersection(base.index)) >= MIN_RUNS
        and (count := count_unpaired(own.index, base.index))
    )
    return compared, lines + listed(UNPAIRED, unpaired)


def identity_lines(groups: Sequence[Sequence[str]]) -> list[str]:
    r"""Return lines that list identical conditions, see `Results.identical`.

    >>> print(*identity_lines([("chain", "star")]), sep="\n")
    Identical in every episode, by every measure:
      chain = star
    """
    head = ["Identical in every episode, by every measure:"] if groups else []
    return head + [f"  {line}" for same in groups for line in wrap(" = ".join(same), WIDTH - 2)]
