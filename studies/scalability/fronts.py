"""Pareto fronts of performance against a cost, and the best hierarchy within a budget.

The probability that a hierarchy is on the front, or is the best within the budget, is the share of
bootstrap resamples of the shared seeds in which it is (Efron 1979).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core.numerics import BoolArray, IntArray
from ..errors import SpecError
from ..results.statistics import Array
from .data import ScalabilityData, cost_of

RESAMPLES = 2000
"""Bootstrap resamples of seeds; probabilities are then known to 0.02."""
ROUNDING = 1e-13
"""Relative difference of means that counts as rounding."""
LIMIT = re.compile(r"\s*([\w.]+)\s*<=\s*([0-9.eE+-]+)\s*")
"""One part of a budget, such as ``messages <= 50``."""


class FrontPoint(NamedTuple):
    """A hierarchy at one size with one cost."""

    size: float
    cost: str
    hierarchy: str
    performance: float
    cost_value: float
    on_front: bool
    probability: float
    """Probability that it is on the front."""


class BudgetChoice(NamedTuple):
    """The best hierarchy within a budget at one size."""

    size: float
    hierarchy: str | None
    """None if no hierarchy is within the budget."""
    probability: float
    """Probability that this choice is the best one within the budget."""
    allowed: tuple[str, ...]
    """Hierarchies within the budget."""
    unknown: tuple[str, ...] = ()
    """Hierarchies of which a cost of the budget is not known; none of them is chosen."""


def non_dominated(performance: Array, cost: Array) -> BoolArray:
    """Return which points ``(..., n)`` no other point beats.

    A point is beaten by one with at least its performance at no higher cost that is better in one
    of the two.

    Examples
    --------
    >>> non_dominated(np.array([0.9, 0.8, 0.95]), np.array([10.0, 20.0, 30.0])).tolist()
    [True, False, True]
    """
    better = performance[..., None, :] >= performance[..., :, None]
    cheaper = cost[..., None, :] <= cost[..., :, None]
    strictly = (performance[..., None, :] > performance[..., :, None]) | (
        cost[..., None, :] < cost[..., :, None]
    )
    return np.logical_not(np.any(better & cheaper & strictly, axis=-1))


def pareto_points(data: ScalabilityData) -> list[FrontPoint]:
    """Return a point for every cost, size and hierarchy, with its place on the Pareto front.

    A size is left out if fewer than two hierarchies have the cost or if they share no seed.
    """
    points = []
    for name, cells in data.costs.items():
        for size in data.all_sizes:
            hierarchies, (values, costs) = data.paired_at(size, [cells])
            if len(hierarchies) < 2 or not len(values):
                continue
            drawn = _resample(len(values))
            on_front = non_dominated(data.sign * values.mean(axis=0), costs.mean(axis=0))
            resampled = non_dominated(
                data.sign * values[drawn].mean(axis=1), costs[drawn].mean(axis=1)
            ).mean(axis=0)
            means = values.mean(axis=0).tolist(), costs.mean(axis=0).tolist()
            places = zip(hierarchies, *means, on_front.tolist(), resampled.tolist(), strict=True)
            points += [FrontPoint(size, name, *own) for own in places]
    return points


def parse_budget(text: str) -> dict[str, float]:
    """Return the limits of a budget by the name of the cost.

    Raises
    ------
    SpecError
        If a part of it is not ``COST <= NUMBER``, or a cost occurs twice; one line.

    Examples
    --------
    >>> parse_budget("messages <= 50, decision_ms <= 100")
    {'messages': 50.0, 'decision_ms': 100.0}
    """
    limits: dict[str, float] = {}
    for part in text.split(","):
        match = LIMIT.fullmatch(part)
        try:
            cost, limit = match[1], float(match[2])  # type: ignore[index]
        except (TypeError, ValueError):
            raise SpecError(
                f"budget = {part.strip()!r}: must be COST <= NUMBER, such as messages <= 50"
            ) from None
        if cost in limits:
            raise SpecError(f"budget = {text!r}: {cost} stands twice")
        limits[cost] = limit
    return limits


def best_within(data: ScalabilityData, limits: Mapping[str, float]) -> list[BudgetChoice]:
    """Return the best hierarchy within a budget at every size.

    Raises
    ------
    SpecError
        If a cost was not measured, or no hierarchy of any size is within the budget; one line.
    """
    cells = {name: cost_of(data, name) for name in limits}
    choices = [_choose(data, size, limits) for size in data.all_sizes]
    if all(choice.hierarchy is None for choice in choices):
        lowest = {name: min(float(own.mean()) for own in cells[name].values()) for name in limits}
        least = ", ".join(f"{name} >= {value:g}" for name, value in lowest.items())
        raise SpecError(f"budget: no hierarchy of any size is within it; least measured: {least}")
    return choices


def _choose(data: ScalabilityData, size: float, limits: Mapping[str, float]) -> BudgetChoice:
    here = data.at_size(size)
    hierarchies, (values, *each) = data.paired_at(size, [data.costs[cost] for cost in limits])
    if not len(values):
        return BudgetChoice(size, None, 0.0, (), here)
    unknown = tuple(name for name in here if name not in hierarchies)
    values = data.sign * values
    costs = dict(zip(limits, each, strict=True))
    (best,), (allowed,) = _best(values, costs, limits, np.arange(len(values))[None])
    if not allowed.any():
        return BudgetChoice(size, None, 0.0, (), unknown)
    resampled, _ = _best(values, costs, limits, _resample(len(values)))
    names = tuple(name for name, ok in zip(hierarchies, allowed, strict=True) if ok)
    choice = int(best.argmax())
    share = float(resampled[:, choice].mean())
    return BudgetChoice(size, hierarchies[choice], share, names, unknown)


def _best(
    values: Array, costs: Mapping[str, Array], limits: Mapping[str, float], drawn: IntArray
) -> tuple[Array, BoolArray]:
    """Return by resample the share of each column in being the best, and which are within.

    Columns of the same mean share it.
    """
    allowed = np.ones((len(drawn), values.shape[1]), dtype=bool)
    for name, limit in limits.items():
        allowed &= costs[name][drawn].mean(axis=1) <= limit
    means = np.where(allowed, values[drawn].mean(axis=1), -np.inf)
    return _shares_of_greatest(means) * allowed, allowed


def are_greatest(means: Array) -> BoolArray:
    """Return which means ``(..., n)`` are the greatest; those that differ by rounding only tie."""
    greatest = means.max(axis=-1, keepdims=True)
    ties: BoolArray = means >= greatest - ROUNDING * np.abs(greatest)
    return ties


def _shares_of_greatest(means: Array) -> Array:
    """Return 1 for the greatest value of each row; equal ones share it."""
    greatest = are_greatest(means)
    shares: Array = greatest / greatest.sum(axis=1, keepdims=True)
    return shares


def _resample(n_seeds: int) -> IntArray:
    return np.random.default_rng(0).integers(n_seeds, size=(RESAMPLES, n_seeds))


def probability_of_best(columns: Sequence[Array]) -> Array:
    """Return for each column of paired seeds the probability that its mean is the greatest."""
    values = np.stack(columns, axis=1)
    means = values[_resample(len(values))].mean(axis=1)
    shares: Array = _shares_of_greatest(means).mean(axis=0)
    return shares
