"""Differences between conditions: intervals, permutation tests and effect sizes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from .notation import format_estimate, format_p
from .permutation_tests import holm, independent_permutation, paired_permutation
from .statistics import (
    Array,
    Estimate,
    bootstrap,
    cliffs_delta,
    differ_equally,
    exactly,
    probability_higher,
    rate,
    welch,
)


@dataclass(frozen=True)
class Difference:
    """Difference between a condition and its reference."""

    condition: str
    measure: str
    estimate: Estimate
    """Mean difference with its 95% interval."""
    raw: float
    """Unadjusted p of no difference, by permutation."""
    p: float
    """p adjusted by Holm's method over all differences that were compared together."""
    values: tuple[Array, Array] = field(repr=False, compare=False)
    """Compared values of the condition and of the reference, ``(n_seeds,)`` each."""
    paired: bool = True
    """Whether runs of equal seed were compared; otherwise the samples are independent."""

    @property
    def seeds(self) -> int:
        """Number of seeds that both have, or the size of the smaller independent sample."""
        return min(map(len, self.values))

    @property
    def sample(self) -> Array:
        """Differences of single seeds ``(n_seeds,)``; empty for independent samples."""
        return np.subtract(*self.values) if self.paired else np.empty(0)

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
        """Cliff's delta: probability of a higher value minus that of a lower one."""
        return cliffs_delta(*self.values)


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
        The compared measure; its range limits the intervals.
    """
    compared = [
        (group, difference)
        for group, pairs in groups.items()
        for pair in pairs
        if (difference := compare_pair(*pair, measure)) is not None
    ]
    adjusted = _adjusted([difference for _, difference in compared])
    computed = {group: tuple[Difference, ...]() for group in groups}
    for (group, _), difference in zip(compared, adjusted, strict=True):
        computed[group] += (difference,)
    return computed


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
    paired = len(one) >= MIN_RUNS
    if paired:
        estimate = paired_difference(one, other, measure)
        p = paired_permutation(one, other)
    elif min(len(own), len(base)) < MIN_RUNS:
        return None
    else:
        one, other = (np.sort(np.asarray(values, float)) for values in (own, base))
        estimate = independent_difference(one, other, measure)
        p = independent_permutation(one, other)
    return Difference(condition, title, estimate, p, p, (one, other), paired)


def _adjusted(compared: Sequence[Difference]) -> list[Difference]:
    """Return differences with p adjusted over all of them by Holm's method."""
    ps = holm([d.raw for d in compared]).tolist()
    return [replace(d, p=p) for d, p in zip(compared, ps, strict=True)]


def adjust(
    compared: Sequence[tuple[str, str, Array, Array, Estimate]],
) -> tuple[Difference, ...]:
    """Return differences of paired values ``(n_seeds,)`` with given estimates.

    p is adjusted over all of them by Holm's method.

    Parameters
    ----------
    compared
        Condition, measure, values of the condition and of the reference, and their difference.
    """
    computed = []
    for condition, measure, own, base, estimate in compared:
        p = paired_permutation(own, base)
        computed.append(Difference(condition, measure, estimate, p, p, (own, base)))
    return tuple(_adjusted(computed))


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
    if measure.is_rate and differ_equally(own, base):
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


def count_unpaired(own: pd.Index, base: pd.Index) -> str:
    """Return the number of runs without a partner, of all; empty if every run has one.

    >>> count_unpaired(pd.Index([0, 1, 2]), pd.Index([0, 2])), count_unpaired(*[pd.Index([0])] * 2)
    ('1 of 5', '')
    """
    count = int((~own.isin(base)).sum() + (~base.isin(own)).sum())
    return f"{count} of {len(own) + len(base)}" if count else ""


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
    return difference_of_estimates(rate(first, level), rate(second, level))


def difference_of_estimates(first: Estimate, second: Estimate) -> Estimate:
    """Return the first estimate minus the second, with intervals combined as independent ones."""
    value = first.value - second.value
    low = value - np.hypot(first.value - first.low, second.high - second.value)
    high = value + np.hypot(first.high - first.value, second.value - second.low)
    return Estimate(value, low, high)


def ratio(numerator: ArrayLike, denominator: ArrayLike) -> Estimate:
    """Return the ratio of two success rates, from outcomes ``(n_runs, n_episodes)``.

    The interval combines those of the two rates as `difference` does (Donner and Zou 2012). Where
    the denominator may be zero there is no upper bound; a ratio to zero is NaN.

    Examples
    --------
    >>> e = ratio([[1, 1, 0, 1]] * 20, np.ones((20, 4)))
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '0.75 [0.63, 0.92]'
    """
    a = rate(numerator)
    b = rate(denominator)
    if not b.value > 0.0:
        return exactly(np.nan)
    product = a.value * b.value
    bounds = []
    for own, other, sign, unknown in ((a.low, b.high, -1.0, 0.0), (a.high, b.low, 1.0, np.inf)):
        scale = other * (2.0 * b.value - other)
        root = np.sqrt(np.maximum(product**2 - own * (2.0 * a.value - own) * scale, 0.0))
        bounds.append(np.asarray((product + sign * root) / scale if scale > 0.0 else unknown))
    return Estimate(a.value / b.value, *bounds)
