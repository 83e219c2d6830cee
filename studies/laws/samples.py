"""Samples of a measure at several sizes, on a scale on which laws of growth are simple curves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core.numerics import BoolArray, special
from ..results.statistics import Array
from .curves import BREAK, FLOOR, LOGISTIC, POWER, QUADRATIC, Curve

FLAT = 1e-9
"""Variance of seeds that counts as rounding."""
MIN_SIZE = 1.0
"""Minimum size."""


class Scale(NamedTuple):
    """A scale on which means are fitted."""

    quantity: str
    """Name of the quantity; its logarithm is fitted."""
    curves: tuple[Curve, ...]
    """Laws, simple ones first."""
    back: Callable[[Array], Array]
    """Return means of fitted values."""
    weight: Callable[[Array], Array]
    """Return the inverse relative variance of a seed at fitted values."""


def _certain(values: Array) -> Array:
    return np.ones_like(values)


def _binomial(logits: Array) -> Array:
    """Return the inverse variance of a logit, relative to that of a rate of one half."""
    return 4.0 * special.expit(logits) * special.expit(-logits)


def _exp(values: Array) -> Array:
    with np.errstate(over="ignore"):
        return np.exp(values)


LOG = Scale("mean", (POWER, QUADRATIC, FLOOR, BREAK), _exp, _certain)
GEOMETRIC = LOG._replace(quantity="geometric mean")
LOGIT = Scale("odds", (LOGISTIC, BREAK), special.expit, _binomial)
DIFFERENCE = Scale("ratio", (LOGISTIC, BREAK), np.array, _certain)


class Sample(NamedTuple):
    """Measurements at several sizes with the same seeds."""

    sizes: Array
    """``(m,)`` in ascending order, 1 or more."""
    values: Array
    """``(n_seeds, m)`` linearized values on the scale; their mean is fitted."""
    observed: Array
    """``(n_seeds, m)`` the values themselves."""
    censored: BoolArray
    """``(n_seeds, m)`` whether a value is only known to be larger."""
    weights: Array
    """``(m,)`` inverse relative variances of a seed."""
    scale: Scale
    min_noise: float = 0.0
    """Minimum variance of a seed of weight 1, on the scale."""
    bounds: tuple[float, float] = (-math.inf, math.inf)
    """Minimum and maximum of a mean."""

    def first(self, m: int) -> Sample:
        """Return the sample of the m smallest sizes."""
        return self._replace(
            sizes=self.sizes[:m],
            values=self.values[:, :m],
            observed=self.observed[:, :m],
            censored=self.censored[:, :m],
            weights=self.weights[:m],
        )

    @property
    def is_flat(self) -> bool:
        """Whether all seeds agree at every size."""
        return float(self.values.var(axis=0).max()) <= FLAT

    @property
    def means(self) -> Array:
        """Means over seeds ``(m,)`` as the table has them; geometric means of censored values."""
        if self.scale is GEOMETRIC:
            return _exp(self.values.mean(axis=0))
        return np.asarray(self.observed.mean(axis=0))


def check_sizes(sizes: Array) -> None:
    """Refuse sizes that are not finite or below 1.

    Raises
    ------
    ValueError
        One line that names the first of them.
    """
    for size in np.atleast_1d(sizes).tolist():
        if not MIN_SIZE <= size < math.inf:
            raise ValueError(f"size = {size:g}, allowed: finite sizes of 1 or more")


def of_numbers(
    sizes: Array, values: Array, bounds: tuple[float, float] = (-math.inf, math.inf)
) -> Sample:
    """Return a sample of numbers ``(n_seeds, m)`` with positive means.

    Raises
    ------
    ValueError
        If a number is not finite, a mean is not positive, or a size is below 1; one line.
    """
    means = _checked_means(sizes, values)
    if not (means > 0.0).all():
        size = sizes[int(np.argmin(means))]
        raise ValueError(
            f"the mean at size {size:g} is {means.min():.4g}, allowed: positive means. A law of "
            "growth describes quantities above 0: fit another measure, as --measure steps, or "
            "fit a cost (the negated return) from a table of scores"
        )
    linear = np.log(means) + values / means - 1.0
    unseen = np.zeros(values.shape, dtype=bool)
    return Sample(sizes, linear, values, unseen, np.ones(len(sizes)), LOG, bounds=bounds)


def of_times(sizes: Array, values: Array, censored: BoolArray) -> Sample:
    """Return a sample of positive numbers ``(n_seeds, m)``, some of which are censored.

    Raises
    ------
    ValueError
        If a number is not positive and finite, all are censored, or a size is below 1; one line.
    """
    _checked_means(sizes, values)
    if not (values > 0.0).all():
        raise ValueError(f"a time is {values.min():.4g}, allowed: positive times")
    if censored.all():
        raise ValueError(
            f"no run reached the criterion: all are censored, at {values.min():g} decisions or more"
        )
    return Sample(sizes, np.log(values), values, censored, np.ones(len(sizes)), GEOMETRIC)


def of_rates(sizes: Array, rates: Array, episodes: Array | float) -> Sample:
    """Return a sample of success rates ``(n_seeds, m)``, each of so many episodes.

    Raises
    ------
    ValueError
        If a rate is not between 0 and 1, or a size is below 1; one line.
    """
    means = _checked_means(sizes, rates)
    if not ((rates >= 0.0) & (rates <= 1.0)).all():
        raise ValueError("a rate is outside of 0 to 1")
    counts = len(rates) * np.broadcast_to(episodes, means.shape)
    shrunk = (means * counts + 0.5) / (counts + 1.0)  # log odds of 0 and 1 are infinite
    slopes = 1.0 / (shrunk * (1.0 - shrunk))
    logits = special.logit(shrunk)
    values = logits + slopes * (rates - means)
    unseen = np.zeros(values.shape, dtype=bool)
    least = 4.0 / float(np.mean(episodes))
    weights = _binomial(logits)
    return Sample(sizes, values, rates, unseen, weights, LOGIT, least, (0.0, 1.0))


def _checked_means(sizes: Array, values: Array) -> Array:
    """Return the means over seeds ``(m,)``; refuse sizes and values that have no law."""
    check_sizes(sizes)
    if not values.size or not np.isfinite(values).all():
        raise ValueError("a value is missing or not finite")
    return np.asarray(values.mean(axis=0))


def apart(own: Sample, base: Sample) -> Sample:
    """Return the differences from the values of the same seeds at the same sizes, on the scale.

    Influences that act on both alike cancel, so that their law deviates less than either. The
    differences may be negative, and have the laws of log odds.
    """
    both, first, second = np.intersect1d(own.sizes, base.sizes, return_indices=True)
    values = own.values[:, first] - base.values[:, second]
    weights = 1.0 / (1.0 / own.weights[first] + 1.0 / base.weights[second])
    return Sample(
        sizes=both,
        values=values,
        observed=own.observed[:, first] - base.observed[:, second],
        censored=own.censored[:, first] | base.censored[:, second],
        weights=weights / weights[-1],
        scale=DIFFERENCE,
    )
