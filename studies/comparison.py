"""Conditions against a reference, seed by seed, on the worlds that both have met."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .paired_tests import holm, paired_permutation
from .results import Results
from .statistics import Estimate, bootstrap

LEVEL = 0.05
"""What p must stay below for a difference to be called one."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Difference:
    """A condition minus the reference.

    Attributes
    ----------
    condition, measure
        What is compared by what.
    seeds
        How many seeds both have finished.
    estimate
        The mean difference with its 95 % bootstrap interval.
    p
        Of no difference, by permutation of signs; adjusted over all that were compared together.
    """

    condition: str
    measure: str
    seeds: int
    estimate: Estimate
    p: float

    @property
    def shown(self) -> str:
        """Value, interval and p as text."""
        e, p = self.estimate, f"p = {self.p:.2g}" if self.p >= 0.001 else "p < .001"
        return f"{e.value:+.2f} [{e.low:+.2f}, {e.high:+.2f}], {p}"


def differences(
    results: Results,
    reference: str,
    conditions: Sequence[str],
    measures: Mapping[str, Callable[[Results, str], ArrayLike]],
) -> tuple[Difference, ...]:
    """Compare conditions with a reference by several measures at once.

    Parameters
    ----------
    results
        Of the study.
    reference, conditions
        Labels; conditions that share fewer than two seeds with the reference are left out.
    measures
        By title, what gives the values ``(n_seeds,)`` of a condition.
    """
    found = []
    for title, values in measures.items():
        for condition in conditions:
            pairs = paired(results, reference, condition, values)
            if len(pairs) >= 2:
                base, other = pairs.T
                estimate = bootstrap(other - base)
                raw = paired_permutation(other, base)
                found.append(Difference(condition, title, len(pairs), estimate, raw))
    adjusted = holm([d.p for d in found])
    return tuple(
        Difference(d.condition, d.measure, d.seeds, d.estimate, float(p))
        for d, p in zip(found, adjusted, strict=True)
    )


def paired(
    results: Results,
    first: str,
    second: str,
    values: Callable[[Results, str], ArrayLike],
) -> Array:
    """Return the values of two conditions ``(n_seeds, 2)`` for the seeds that both have."""
    if first not in results.seeds or second not in results.seeds:
        return np.zeros((0, 2))
    columns: list[dict[int, Any]] = [
        dict(zip(results.seeds[name], np.asarray(values(results, name)), strict=True))
        for name in (first, second)
    ]
    shared = [seed for seed in columns[0] if seed in columns[1]]
    return np.array([[column[seed] for column in columns] for seed in shared]).reshape(-1, 2)


def ratio(
    numerator: ArrayLike, denominator: ArrayLike, *, resamples: int = 4000, seed: int = 0
) -> Estimate:
    """Return the ratio of two paired means ``(n_seeds,)`` with its 95 % bootstrap interval.

    Both are resampled together, seed by seed; a resample whose denominator is zero counts as
    infinite, and a ratio to zero is not a number.

    Examples
    --------
    >>> e = ratio([0.8, 0.9, 1.0], [1.0, 1.0, 1.0])
    >>> f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}]"
    '0.90 [0.80, 1.00]'
    """
    pairs = np.stack([np.asarray(numerator, float), np.asarray(denominator, float)], axis=1)
    top, bottom = pairs.mean(axis=0)
    value = np.asarray(top / bottom if bottom > 0.0 else np.nan)
    if len(pairs) < 2 or np.isnan(value):
        return Estimate(value, np.full_like(value, np.nan), np.full_like(value, np.nan))
    rng = np.random.default_rng(seed)
    means = pairs[rng.integers(len(pairs), size=(resamples, len(pairs)))].mean(axis=1)
    drawn = np.full(resamples, np.inf)
    np.divide(means[:, 0], means[:, 1], out=drawn, where=means[:, 1] > 0.0)
    # Not interpolated: between a number and infinity there is none.
    low, high = np.quantile(drawn, [0.025, 0.975], method="nearest")
    return Estimate(value, np.asarray(low), np.asarray(high))
