"""What a study makes of its results: a table, words about it, and what its figures show.

The table has conditions against estimates. Conditions are compared with a reference seed by seed,
on the worlds that both have met.
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
from .power import power_lines
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
    paired_tests,
    rate,
    welch,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EVALUATED = "evaluation success"
"""Title of the success of a trained team in the scenario of its condition."""


class Summary(NamedTuple):
    """A line of the table."""

    condition: str
    """Label of the condition."""
    seeds: int
    """Number of seeds that have finished."""
    estimates: dict[str, Estimate]
    """Estimates of no dimension by title."""


def evaluated(results: Results, condition: str) -> dict[str, Estimate]:
    """Return how a condition's trained teams do by title, in its own scenario and others.

    By `Results.main`. Those of `[evaluations]` are called ``success, NAME``.
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
    """Return the mean of a measure of episodes, or of a part, with its interval over seeds."""
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

    Unlike that of a share, the interval has no width where all episodes are equally long.
    """
    value, low, high = bootstrap(means, bounds=NOT_NEGATIVE)
    return Estimate(value, low, np.minimum(high, steps.bounds[1]))


@dataclass(frozen=True)
class Difference:
    """The difference between a condition and the reference."""

    condition: str
    """Name of the condition that is compared with the reference."""
    measure: str
    """Name of the measure."""
    seeds: int
    """Number of seeds that both have, or the size of the smaller one of independent samples."""
    estimate: Estimate
    """The mean difference with its 95% interval."""
    raw: float
    """Unadjusted p of no difference, by permutation."""
    p: float
    """p adjusted over all differences that were compared together, by Holm's method."""
    sample: Array = field(repr=False, compare=False)
    """Differences of single seeds ``(n_seeds,)``; empty for independent samples."""
    paired: bool = True
    """Whether runs of equal seed were compared; otherwise the samples are independent."""

    @property
    def shown(self) -> str:
        """Value, interval, adjusted and unadjusted p, as text; says if samples are independent."""
        raw = format_p(self.raw)
        shown = f"{format_estimate(self.estimate, signed=True)}, p {format_p(self.p)}"
        kind = "" if self.paired else ", independent samples"
        return f"{shown} ({raw.removeprefix('= ')} unadjusted){kind}"


MIN_RUNS = 2
"""Smallest number of runs that can be compared."""
BySeed: TypeAlias = "pd.Series | pd.DataFrame"
"""Values with their seeds as index."""
Pair = tuple[str, str, BySeed, BySeed]
"""What is compared, by which measure, and the values of it and of its reference, by seed."""


def differences(
    groups: Mapping[str, Iterable[Pair]], measure: Measure = SUCCESS
) -> dict[str, tuple[Difference, ...]]:
    """Compare conditions with their references; p is adjusted over all groups by Holm's method.

    Parameters
    ----------
    groups
        By the name of a group, the pairs to compare, see `compare_pair`.
    measure
        The measure whose means are compared: no interval leaves its range.
    """
    names = []
    compared = []
    for group, pairs in groups.items():
        for condition, title, own, base in pairs:
            compared_pair = compare_pair(condition, title, own, base, measure)
            if compared_pair is not None:
                names.append(group)
                compared.append(compared_pair)
    made = list(zip(names, adjusted(compared), strict=True))
    return {g: tuple(d for name, d in made if name == g) for g in groups}


def compare_pair(
    condition: str, title: str, own: BySeed, base: BySeed, measure: Measure
) -> Difference | None:
    """Compare the values of a condition with those of a reference, both by seed.

    Runs of equal seed are paired. Without two common seeds the samples are independent: the
    interval is Welch's, and p is by permutation of labels.

    Returns
    -------
    Difference or None
        The difference, its p not adjusted; None if there are too few runs.
    """
    one, other = select_shared([own, base])
    if len(one) >= MIN_RUNS:
        estimate = paired_difference(one, other, measure)
        p = paired_permutation(one, other)
        return Difference(condition, title, len(one), estimate, p, p, one - other)
    if min(len(own), len(base)) < MIN_RUNS:
        return None
    one, other = (np.asarray(values, float) for values in (own, base))
    estimate = independent_difference(one, other, measure)
    p = independent_permutation(one, other)
    fewer = min(len(one), len(other))
    return Difference(condition, title, fewer, estimate, p, p, np.empty(0), paired=False)


def adjusted(compared: Sequence[Difference]) -> list[Difference]:
    """Return differences whose p is adjusted over all of them by Holm's method."""
    ps = holm([d.raw for d in compared]).tolist()
    return [replace(d, p=p) for d, p in zip(compared, ps, strict=True)]


def adjust(
    compared: Sequence[tuple[str, str, Array, Array, Estimate]],
) -> tuple[Difference, ...]:
    """Return what is compared, by which measure, of pairs ``(n_seeds,)`` with an estimate.

    p is adjusted over all of them by Holm's method.
    """
    tests = paired_tests([(own, base) for _, _, own, base, _ in compared])
    return tuple(
        Difference(condition, measure, len(own), estimate, *ps, own - base)
        for (condition, measure, own, base, estimate), ps in zip(compared, tests, strict=True)
    )


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

    The interval is by bootstrap over seeds. It stays within what the range of the measure allows.
    Rates that differ alike for every seed are taken for independent, because the interval of a
    bootstrap would have no width.
    """
    if measure.is_rate and np.ptp(own - base) == 0.0:
        return difference(own[:, None], base[:, None])
    least, greatest = measure.bounds
    return bootstrap(own - base, bounds=(least - greatest, greatest - least))


def select_shared(values: Sequence[BySeed]) -> list[Array]:
    """Return values ``(n_seeds, ...)`` of the seeds that all have, of those by seed.

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
    """Return the first success rate less the second, from outcomes ``(n_runs, n_episodes)``.

    The interval combines those of the two rates (Newcombe 1998; Zou and Donner 2008). It takes the
    rates for independent, which is careful where runs are paired; and unlike a bootstrap it has a
    width even if all runs ended alike.

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
    the denominator may be zero there is no upper end; a ratio to zero is not a number.

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
    ends = []
    for own, other, sign, unknown in ((a.low, b.high, -1.0, 0.0), (a.high, b.low, 1.0, np.inf)):
        scale = other * (2.0 * b.value - other)
        root = np.sqrt(np.maximum(product**2 - own * (2.0 * a.value - own) * scale, 0.0))
        ends.append(np.asarray((product + sign * root) / scale if scale > 0.0 else unknown))
    return Estimate(a.value / b.value, *ends)


def phases_of(results: Results) -> dict[str, str]:
    """Return training and evaluation, if all trained conditions have them, by what is compared."""
    conditions = results.of_phase("training")
    return {
        f"{phase} {results.main.heading}": phase
        for phase in ("training", "evaluation")
        if all(results.has(condition, phase) for condition in conditions)
    }


Figures: TypeAlias = "dict[str, Figure]"
"""The figures of an analysis by name."""


class Case(NamedTuple):
    """One condition of a study of systems, as its figure has it."""

    system: str
    """Name of its override: what learns and decides."""
    setting: Any
    """What else it differs in: the number of robots, the game, the exploration."""
    values: Mapping[Any, Estimate]
    """Its estimates, by title or by number of plays."""


@dataclass(frozen=True)
class Analysis:
    """The analysis of a study."""

    table: tuple[Summary, ...]
    """Its lines, one for each condition or case."""
    notes: tuple[str, ...] = ()
    """Lines that are printed below the table: legend, verdicts, power."""
    cases: Sequence[Any] = ()
    """What the study's figures are drawn from."""
    differences: Mapping[str, Sequence[Difference]] = field(default_factory=dict)
    """What was compared, by measure or by setting, p adjusted over all."""


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
"""Said once where an interval and p seem to contradict each other."""


def verdict_lines(
    differences: Sequence[Difference], better: str | None = "higher"
) -> Iterator[str]:
    """Yield a line for every difference of one measure: the significant ones first, sorted.

    `better` are higher or lower values, or None: then they are called so.
    """
    words = {"higher": ("worse", "better"), "lower": ("better", "worse"), None: ("lower", "higher")}
    for d in sorted(differences, key=lambda d: (d.p >= LEVEL, float(d.estimate.value))):
        is_higher = bool(d.estimate.value > 0)
        word = words[better][is_higher] if d.p < LEVEL else "no significant difference"
        yield from wrapped(f"{word}: {d.condition}, {d.shown}", "  ")


def verdicts(
    groups: Mapping[str, Sequence[Difference]], measure: Measure = SUCCESS, title: str = ""
) -> list[str]:
    """Return the verdicts of groups below their heads, how p is adjusted, and `power_lines`.

    There are no lines if nothing is compared. p must be adjusted over all groups. The power is
    that of a `title`, by default of what the differences are called.
    """
    compared = [d for group in groups.values() for d in group]
    lines = []
    for head, group in groups.items():
        if group:
            lines += wrapped(f"{head}:")
            lines += verdict_lines(group, measure.better)
    if compared:
        counted = f"{len(compared)} comparison{'s' * (len(compared) > 1)}"
        tests = [text for paired, text in TESTS.items() if paired in {d.paired for d in compared}]
        lines += wrapped(f"p: {' and '.join(tests)}, adjusted over {counted} (Holm).")
    if any(map(_seems_contradicted, compared)):
        lines += wrapped(TWO_TESTS)
    title = title or " or ".join(dict.fromkeys(d.measure for d in compared))
    samples = [d.sample for d in compared if d.paired]
    return lines + power_lines(samples, title, of_rates=measure.is_rate)


def _seems_contradicted(difference: Difference) -> bool:
    """Return whether an interval and p seem to say different things of a difference."""
    e = difference.estimate
    is_beside_zero = bool(e.low > 0.0 or e.high < 0.0)
    return is_beside_zero != (difference.p < LEVEL)


def judged(
    groups: Mapping[str, Iterable[Pair]], less: str, measure: Measure = SUCCESS, title: str = ""
) -> tuple[dict[str, tuple[Difference, ...]], list[str]]:
    """Return the `differences` of groups, and their `verdicts`.

    `less` is what the reference is, `title` what is compared, unless the groups say so.
    """
    compared = differences(groups, measure)
    heads = {group: ": ".join(filter(None, (group, title))) for group in groups}
    by_head = {f"{heads[g]}, less that of {less}": compared[g] for g in groups}
    return compared, verdicts(by_head, measure)


def identity_lines(groups: Sequence[Sequence[str]]) -> list[str]:
    r"""Return lines that say which conditions are identical, see `Results.identical`.

    >>> print(*identity_lines([("chain", "star")]), sep="\n")
    Identical in every episode, by every measure:
      chain = star
    """
    head = ["Identical in every episode, by every measure:"] if groups else []
    return head + [f"  {line}" for same in groups for line in wrap(" = ".join(same), WIDTH - 2)]
