"""Conditions against a reference, seed by seed, on the worlds that both have met."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.plugins.deferred import pd
from .paired_tests import LEVEL, Friedman, friedman, holm, paired_permutation
from .results import Results
from .statistics import Estimate, bootstrap, rate
from .summary import EVALUATED

Array = NDArray[np.float64]

PHASES = {"training success": "training", EVALUATED: "evaluation"}
"""Measures that conditions are compared by: success rates in these phases."""


@dataclass(frozen=True)
class Difference:
    """A condition minus the reference."""

    condition: str
    """What is compared with the reference."""
    measure: str
    """By what it is compared."""
    seeds: int
    """How many seeds both have finished."""
    estimate: Estimate
    """The mean difference with its 95 % bootstrap interval."""
    raw: float
    """p of no difference, by permutation of signs."""
    p: float
    """The same, adjusted over all that were compared together, see `adjusted`."""
    sample: Array = field(repr=False, compare=False)
    """The differences of single seeds ``(n_seeds,)``."""

    @property
    def shown(self) -> str:
        """Value, interval, p as it is and adjusted, as text."""
        e = self.estimate
        interval = f"{_signed(e.value)} [{_signed(e.low)}, {_signed(e.high)}]"
        return f"{interval}, {_p(self.p)} ({_p(self.raw, '')} unadjusted)"


def _signed(value: ArrayLike) -> str:
    """Return a difference with its sign, which rounding errors about 0 have not."""
    text = f"{float(np.asarray(value)):+.2f}"
    return "0.00" if text in ("+0.00", "-0.00") else text


def _p(value: float, name: str = "p ") -> str:
    if value < 0.001:
        return f"{name}< .001"
    return f"{name}{'= ' if name else ''}{value:.2g}"


BySeed: TypeAlias = "pd.Series | pd.DataFrame"
"""Values with their seeds as index."""
Pair = tuple[str, str, BySeed, BySeed]
"""What is compared, by which measure, and the values of it and of its reference, by seed."""


def differences(
    groups: Mapping[str, Iterable[Pair]], *, of_rates: bool = True
) -> dict[str, tuple[Difference, ...]]:
    """Compare conditions with their references; p is adjusted over all groups by Holm's method.

    Parameters
    ----------
    groups
        What is compared, by a name of what it has in common. Pairs that share fewer than two seeds
        are left out.
    of_rates
        Whether values are rates.
    """
    made = []
    for group, pairs in groups.items():
        for condition, measure, *values in pairs:
            own, base = shared(values)
            if len(own) >= 2:
                estimate = paired_difference(own, base, of_rates=of_rates)
                made.append((group, compare_pairs(condition, measure, own, base, estimate)))
    all_of_them = list(zip(made, adjusted([d for _, d in made]), strict=True))
    return {g: tuple(d for (group, _), d in all_of_them if group == g) for g in groups}


def compare_pairs(
    condition: str, measure: str, own: Array, base: Array, estimate: Estimate
) -> Difference:
    """Return what is estimated of paired values ``(n_seeds,)``; its p is not adjusted."""
    raw = paired_permutation(own, base)
    return Difference(condition, measure, len(own), estimate, raw, raw, own - base)


def adjusted(differences: Sequence[Difference]) -> tuple[Difference, ...]:
    """Return differences with p adjusted over all of them by Holm's method."""
    ps = holm([d.raw for d in differences])
    return tuple(replace(d, p=float(p)) for d, p in zip(differences, ps, strict=True))


def paired_difference(own: Array, base: Array, *, of_rates: bool) -> Estimate:
    """Return the mean difference of paired values ``(n_seeds,)`` with its 95 % interval.

    By bootstrap over seeds; of rates that differ alike for every seed, as of independent ones: the
    interval of a bootstrap would have no width.
    """
    if of_rates and np.ptp(own - base) == 0.0:
        return difference(own[:, None], base[:, None])
    return bootstrap(own - base, bounds=(-1.0, 1.0) if of_rates else (-np.inf, np.inf))


def shared(values: Sequence[BySeed]) -> list[Array]:
    """Return values ``(n_seeds, ...)`` of the seeds that all have, of those by seed.

    Examples
    --------
    >>> shared([pd.Series([0.0, 0.1, 0.2], [0, 1, 2]), pd.Series([1.2, 1.1], [2, 1])])
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
    a, b = rate(first, level), rate(second, level)
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
    a, b = rate(numerator, level), rate(denominator, level)
    if not b.value > 0.0:
        return Estimate(*(np.asarray(np.nan) for _ in range(3)))
    product = a.value * b.value
    low_scale = b.high * (2.0 * b.value - b.high)
    high_scale = b.low * (2.0 * b.value - b.low)
    low, high = np.asarray(0.0), np.asarray(np.inf)
    if low_scale > 0.0:
        root = product**2 - a.low * (2.0 * a.value - a.low) * low_scale
        low = np.asarray((product - np.sqrt(np.maximum(root, 0.0))) / low_scale)
    if high_scale > 0.0:
        root = product**2 - a.high * (2.0 * a.value - a.high) * high_scale
        high = np.asarray((product + np.sqrt(np.maximum(root, 0.0))) / high_scale)
    return Estimate(a.value / b.value, low, high)


def phases_of(results: Results) -> dict[str, str]:
    """Return those of `PHASES` that all trained conditions have."""
    conditions = results.of_phase("training")
    return {
        title: phase
        for title, phase in PHASES.items()
        if all(results.has(condition, phase) for condition in conditions)
    }


@dataclass(frozen=True)
class OrderTest:
    """Whether the orders differ at all by one measure."""

    title: str
    """The measure."""
    orders: int
    """How many there are."""
    seeds: int
    """How many seeds all orders have finished."""
    test: Friedman
    """The test."""
    p: float
    """Its p, adjusted over the measures."""

    @property
    def verdict(self) -> str:
        """What the test found, in words."""
        differ = "differ" if self.p < LEVEL else "do not differ significantly"
        return (
            f"{self.title}: {self.orders} orders {differ} (Friedman {self.test.statistic:.1f}, "
            f"p = {self.test.p:.2g}, adjusted {self.p:.2g}; W = {self.test.concordance:.3f}; "
            f"{self.seeds} seeds)"
        )


def order_tests(results: Results) -> tuple[OrderTest, ...]:
    """Return the tests of all orders together, one for each measure that all of them have."""
    conditions = results.of_phase("training")
    made = []
    for title, phase in phases_of(results).items() if len(conditions) > 1 else ():
        means = [results.means(condition, phase) for condition in conditions]
        values = np.stack(shared(means), axis=1)
        if len(values) >= 2:
            made.append((title, len(conditions), len(values), friedman(values)))
    ps = holm([test.p for *_, test in made])
    return tuple(OrderTest(*own, float(p)) for own, p in zip(made, ps, strict=True))
