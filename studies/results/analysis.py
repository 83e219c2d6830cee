"""Tables, differences and verdicts of a study's results.

Conditions are compared with a reference seed by seed, in the same worlds.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from ..errors import WIDTH
from .notation import format_estimate, format_p, wrapped
from .power import independent_power_lines, power_lines
from .results import STEPS, Results, row_means
from .statistics import (
    LEVEL,
    NOT_NEGATIVE,
    Array,
    Estimate,
    bootstrap,
    exactly,
    holm,
    independent_permutation,
    paired_permutation,
    probability_higher,
    rate,
    welch,
)

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
    values = results.values(condition, measure.name, phase, part)
    if measure.is_rate and not np.isnan(values).any():
        return rate(values)
    means = row_means(pd.DataFrame(values)).to_numpy()
    if measure.name == STEPS.name:
        return steps_estimate(means, results.steps(phase))
    return bootstrap(means, bounds=measure.bounds)


def estimate_over_seeds(values: Array, measure: Measure) -> Estimate:
    """Return the mean of values ``(n_seeds,)`` of whole trials with its interval."""
    return rate(values[:, None]) if measure.is_rate else bootstrap(values, bounds=measure.bounds)


def steps_estimate(means: Array, steps: Measure) -> Estimate:
    """Return the mean length of episodes, whose interval ends at the longest allowed.

    Unlike the interval of a share, it has no width where all episodes are equally long.
    """
    value, low, high = bootstrap(means, bounds=NOT_NEGATIVE)
    return Estimate(value, low, np.minimum(high, steps.bounds[1]))


@dataclass(frozen=True)
class Difference:
    """Difference between a condition and its reference."""

    condition: str
    measure: str
    seeds: int
    """Number of seeds that both have, or the size of the smaller independent sample."""
    estimate: Estimate
    """Mean difference with its 95% interval."""
    raw: float
    """Unadjusted p of no difference, by permutation."""
    p: float
    """p adjusted by Holm's method over all differences that were compared together."""
    sample: Array = field(repr=False, compare=False)
    """Differences of single seeds ``(n_seeds,)``; empty for independent samples."""
    paired: bool = True
    """Whether runs of equal seed were compared; otherwise the samples are independent."""
    values: tuple[Array, Array] = field(
        default=(np.empty(0), np.empty(0)), repr=False, compare=False
    )
    """Compared values of the condition and of the reference."""

    @property
    def shown(self) -> str:
        """The difference with its interval and p, as text."""
        raw = format_p(self.raw)
        shown = f"{format_estimate(self.estimate, signed=True)}, p {format_p(self.p)}"
        kind = "" if self.paired else ", independent samples"
        return f"{shown} ({raw.removeprefix('= ')} unadjusted){kind}"

    def improvement(self, better: str | None) -> Estimate:
        """Return the probability that a run does better than one of the reference.

        Ties count half. With `better` None it is the probability of a higher value.
        """
        own, base = self.values
        pair = (base, own) if better == "lower" else (own, base)
        return probability_higher([pair])

    @property
    def cliffs_delta(self) -> float:
        """Cliff's delta (1993): probability of a higher value minus that of a lower one."""
        own, base = self.values
        return float(np.sign(np.subtract.outer(own, base)).mean())


MIN_RUNS = 2
"""Smallest number of runs that can be compared."""
BySeed: TypeAlias = "pd.Series | pd.DataFrame"
"""Values with their seeds as index."""
Pair = tuple[str, str, BySeed, BySeed]
"""Condition, measure, and the values of the condition and of its reference by seed."""


def differences(
    groups: Mapping[str, Iterable[Pair]], measure: Measure = SUCCESS
) -> dict[str, tuple[Difference, ...]]:
    """Compare conditions with their references; p is adjusted over all groups by Holm's method.

    Parameters
    ----------
    groups
        Pairs to compare by group, see `compare_pair`.
    measure
        The measure whose means are compared, whose range limits the intervals.
    """
    compared = [
        (group, difference)
        for group, pairs in groups.items()
        for pair in pairs
        if (difference := compare_pair(*pair, measure)) is not None
    ]
    adjusted = _adjusted([difference for _, difference in compared])
    found = {group: tuple[Difference, ...]() for group in groups}
    for (group, _), difference in zip(compared, adjusted, strict=True):
        found[group] += (difference,)
    return found


def compare_pair(
    condition: str, title: str, own: BySeed, base: BySeed, measure: Measure
) -> Difference | None:
    """Compare the values of a condition with those of a reference, both by seed.

    Runs of equal seed are paired. Without two common seeds the samples are independent: the
    interval is Welch's, and p is by permutation of labels.

    Returns
    -------
    Difference or None
        The difference with unadjusted p; None if there are too few runs.
    """
    one, other = select_shared([own, base])
    if len(one) >= MIN_RUNS:
        estimate = paired_difference(one, other, measure)
        p = paired_permutation(one, other)
        return Difference(
            condition, title, len(one), estimate, p, p, one - other, values=(one, other)
        )
    if min(len(own), len(base)) < MIN_RUNS:
        return None
    one, other = (np.sort(np.asarray(values, float)) for values in (own, base))
    return Difference(
        condition=condition,
        measure=title,
        seeds=min(len(one), len(other)),
        estimate=independent_difference(one, other, measure),
        raw=independent_permutation(one, other),
        p=1.0,
        sample=np.empty(0),
        paired=False,
        values=(one, other),
    )


def _adjusted(compared: Sequence[Difference]) -> list[Difference]:
    """Return differences whose p is adjusted over all of them by Holm's method."""
    ps = holm([d.raw for d in compared]).tolist()
    return [replace(d, p=p) for d, p in zip(compared, ps, strict=True)]


def adjust(
    compared: Sequence[tuple[str, str, Array, Array, Estimate]],
) -> tuple[Difference, ...]:
    """Return differences of paired values ``(n_seeds,)`` whose estimates are given.

    p is adjusted over all of them by Holm's method.

    Parameters
    ----------
    compared
        Condition, measure, values of the condition and of the reference, and their difference.
    """
    found = []
    for condition, measure, own, base, estimate in compared:
        p = paired_permutation(own, base)
        found.append(
            Difference(condition, measure, len(own), estimate, p, p, own - base, values=(own, base))
        )
    return tuple(_adjusted(found))


def independent_difference(own: Array, base: Array, measure: Measure) -> Estimate:
    """Return the difference of the means of independent runs with its 95% interval.

    The interval is Welch's. For constant rates it is Newcombe's, because Welch's has no width.
    """
    if measure.is_rate and np.ptp(own) == np.ptp(base) == 0.0:
        return difference(own[:, None], base[:, None])
    least, greatest = measure.bounds
    return Estimate(*np.clip(welch(own, base), least - greatest, greatest - least))


def paired_difference(own: Array, base: Array, measure: Measure) -> Estimate:
    """Return the mean difference of paired values ``(n_seeds,)`` with its 95% interval.

    The interval is by bootstrap over seeds, within the range of the measure. Rates that differ
    equally for every seed are treated as independent, because their bootstrap interval has no
    width.
    """
    if measure.is_rate and np.ptp(own - base) == 0.0:
        return difference(own[:, None], base[:, None])
    least, greatest = measure.bounds
    return bootstrap(own - base, bounds=(least - greatest, greatest - least))


def select_shared(values: Sequence[BySeed]) -> list[Array]:
    """Return the values ``(n_seeds, ...)`` of the seeds that all have.

    Examples
    --------
    >>> select_shared([pd.Series([0.0, 0.1, 0.2], [0, 1, 2]), pd.Series([1.2, 1.1], [2, 1])])
    [array([0.1, 0.2]), array([1.1, 1.2])]
    """
    seeds = values[0].index
    for other in values:
        seeds = seeds.intersection(other.index, sort=False)
    return [own.loc[seeds].to_numpy() for own in values]


def difference(first: ArrayLike, second: ArrayLike, level: float = 0.95) -> Estimate:
    """Return the first success rate minus the second, from outcomes ``(n_runs, n_episodes)``.

    The interval combines those of the two rates (Newcombe 1998; Zou and Donner 2008). It treats
    the rates as independent, which is conservative where runs are paired. Unlike a bootstrap
    interval it has a width even if all runs ended equally.

    Examples
    --------
    >>> e = difference(np.ones((8, 5)), np.zeros((8, 5)))
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '1.00 [0.54, 1.00]'
    """
    a = rate(first, level)
    b = rate(second, level)
    value = a.value - b.value
    low = value - np.hypot(a.value - a.low, b.high - b.value)
    return Estimate(value, low, value + np.hypot(a.high - a.value, b.value - b.low))


def ratio(numerator: ArrayLike, denominator: ArrayLike, level: float = 0.95) -> Estimate:
    """Return the ratio of two success rates, from outcomes ``(n_runs, n_episodes)``.

    The interval combines those of the two rates as `difference` does (Donner and Zou 2012). Where
    the denominator may be zero there is no upper bound; a ratio to zero is NaN.

    Examples
    --------
    >>> e = ratio([[1, 1, 0, 1]] * 20, np.ones((20, 4)))
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '0.75 [0.63, 0.92]'
    """
    a = rate(numerator, level)
    b = rate(denominator, level)
    if not b.value > 0.0:
        return exactly(np.nan)
    product = a.value * b.value
    bounds = []
    for own, other, sign, unknown in ((a.low, b.high, -1.0, 0.0), (a.high, b.low, 1.0, np.inf)):
        scale = other * (2.0 * b.value - other)
        root = np.sqrt(np.maximum(product**2 - own * (2.0 * a.value - own) * scale, 0.0))
        bounds.append(np.asarray((product + sign * root) / scale if scale > 0.0 else unknown))
    return Estimate(a.value / b.value, *bounds)


def phases_of(results: Results) -> dict[str, str]:
    """Return the phases training and evaluation by title, if all trained conditions have them."""
    conditions = results.of_phase("training")
    return {
        f"{phase} {results.main.heading}": phase
        for phase in ("training", "evaluation")
        if all(results.has(condition, phase) for condition in conditions)
    }


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


NOTHING = "Nothing to compare: no two conditions have two seeds each."
TESTS = {
    True: "permutation of signs over seeds",
    False: "permutation of labels of independent samples, whose intervals are Welch's",
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
    if any(map(_seems_contradicted, compared)):
        lines += wrapped(TWO_TESTS)
    title = title or " or ".join(dict.fromkeys(d.measure for d in compared))
    samples = [d.sample for d in compared if d.paired]
    independent = [d.values for d in compared if not d.paired]
    lines += power_lines(samples, title, of_rates=measure.is_rate)
    return lines + independent_power_lines(independent, len(compared), title)


def _seems_contradicted(difference: Difference) -> bool:
    """Return whether an interval and p seem to disagree about a difference."""
    excludes_zero = bool(difference.estimate.low > 0.0 or difference.estimate.high < 0.0)
    return excludes_zero != (difference.p < LEVEL)


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
    compared = differences(groups, measure)
    heads = {group: ": ".join(filter(None, (group, title))) for group in groups}
    by_head = {f"{heads[g]}, minus that of {reference}": compared[g] for g in groups}
    return compared, verdicts(by_head, measure)


def identity_lines(groups: Sequence[Sequence[str]]) -> list[str]:
    r"""Return lines that list identical conditions, see `Results.identical`.

    >>> print(*identity_lines([("chain", "star")]), sep="\n")
    Identical in every episode, by every measure:
      chain = star
    """
    head = ["Identical in every episode, by every measure:"] if groups else []
    return head + [f"  {line}" for same in groups for line in wrap(" = ".join(same), WIDTH - 2)]
