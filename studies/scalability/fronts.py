"""Best hierarchies and sizes: crossovers, Pareto fronts, and the best within a budget.

The probability that a hierarchy is on the front, or is the best within the budget, is the share of
bootstrap resamples of the shared seeds in which it is (Efron 1979).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import permutations

import numpy as np

from ...core.numerics import BoolArray, IntArray, pd
from ..errors import SpecError
from ..laws.inference import sign_change
from ..results.statistics import Array, Estimate
from .data import ScalabilityData, cost_of, paired

RESAMPLES = 2000
"""Bootstrap resamples of seeds; probabilities are then known to 0.02."""
ROUNDING = 1e-13
"""Relative difference of means that counts as rounding."""
POINT = ["size", "cost", "hierarchy", "performance", "cost_value", "on_front", "probability"]
"""Columns of `pareto_points`."""
CHOICE = ["size", "hierarchy", "probability", "allowed", "unknown"]
"""Columns of `best_within`."""
LIMIT = re.compile(r"\s*([\w.]+)\s*<=\s*([0-9.eE+-]+)\s*")
"""One part of a budget, such as ``messages <= 50``."""


def non_dominated(performance: Array, cost: Array) -> BoolArray:
    """Return which points ``(..., n)`` no other point beats.

    A point is beaten by one with at least its performance at no higher cost that is better in one
    of the two.

    Examples
    --------
    >>> non_dominated(np.array([0.9, 0.8, 0.95]), np.array([10.0, 20.0, 30.0])).tolist()
    [True, False, True]
    """
    better = _at_least(performance[..., None, :], performance[..., :, None])
    worse = _at_least(performance[..., :, None], performance[..., None, :])
    cheaper = _at_least(cost[..., :, None], cost[..., None, :])
    dearer = _at_least(cost[..., None, :], cost[..., :, None])
    return np.logical_not(np.any(better & cheaper & ~(worse & dearer), axis=-1))


def _at_least(values: Array, others: Array) -> BoolArray:
    """Return which values are not below others; those that differ by rounding only tie."""
    ties: BoolArray = values >= others - ROUNDING * np.abs(others)
    return ties


def pareto_points(data: ScalabilityData) -> pd.DataFrame:
    """Return a row for every cost, size and hierarchy: mean performance and cost, place on front.

    A size is left out if fewer than two hierarchies have the cost or if they share no seed. The
    column `on_front` says whether the hierarchy is on the Pareto front, and `probability` how
    probable that is.
    """
    parts = [pd.DataFrame(columns=POINT)]
    for name, cells in data.costs.items():
        for size in data.all_sizes:
            hierarchies, (values, costs) = data.paired_at(size, [cells])
            if len(hierarchies) < 2 or not len(values):
                continue
            better, drawn = data.sign * values, _resample(len(values))
            on_front = non_dominated(better.mean(axis=0), costs.mean(axis=0))
            resampled = non_dominated(better[drawn].mean(axis=1), costs[drawn].mean(axis=1))
            means = values.mean(axis=0), costs.mean(axis=0)
            cells_of = (size, name, hierarchies, *means, on_front, resampled.mean(axis=0))
            parts.append(pd.DataFrame(dict(zip(POINT, cells_of, strict=True))))
    return pd.concat(parts[1:] or parts, ignore_index=True)


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


def best_within(data: ScalabilityData, limits: Mapping[str, float]) -> pd.DataFrame:
    """Return the best hierarchy within a budget at every size, None if none is within.

    Further columns have the probability that it is the best one, the hierarchies within the
    budget, and those of which a cost is not known, so that they are not chosen.

    Raises
    ------
    SpecError
        If a cost was not measured, or no hierarchy of any size is within the budget; one line.
    """
    cells = {name: cost_of(data, name) for name in limits}
    choices = pd.DataFrame(
        [_choose(data, size, limits) for size in data.all_sizes], columns=CHOICE, dtype=object
    )
    if choices["hierarchy"].isna().all():
        lowest = {name: min(float(own.mean()) for own in cells[name].values()) for name in limits}
        least = ", ".join(f"{name} >= {value:g}" for name, value in lowest.items())
        raise SpecError(f"budget: no hierarchy of any size is within it; least measured: {least}")
    return choices


def _choose(data: ScalabilityData, size: float, limits: Mapping[str, float]) -> tuple[object, ...]:
    """Return the row of `best_within` of a size."""
    here = data.at_size(size)
    hierarchies, (values, *each) = data.paired_at(size, [data.costs[cost] for cost in limits])
    unknown = tuple(name for name in here if name not in hierarchies or not len(values))
    costs = dict(zip(limits, each, strict=True))
    if len(values):
        values = data.sign * values
        (best,), (allowed,) = _best(values, costs, limits, np.arange(len(values))[None])
        if allowed.any():
            resampled, _ = _best(values, costs, limits, _resample(len(values)))
            names = tuple(np.array(hierarchies, object)[allowed])
            choice = int(best.argmax())
            share = float(resampled[:, choice].mean())
            return size, hierarchies[choice], share, names, unknown
    return size, None, 0.0, (), unknown


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
    return _at_least(means, means.max(axis=-1, keepdims=True))


def _shares_of_greatest(means: Array) -> Array:
    """Return 1 for the greatest value of each row; equal ones share it."""
    greatest = are_greatest(means)
    shares: Array = greatest / greatest.sum(axis=1, keepdims=True)
    return shares


def _resample(n_seeds: int) -> IntArray:
    return np.random.default_rng(0).integers(n_seeds, size=(RESAMPLES, n_seeds))


def probability_of_best(values: Array) -> Array:
    """Return for each column of ``(n_seeds, n)`` the probability that its mean is the greatest."""
    means = values[_resample(len(values))].mean(axis=1)
    shares: Array = _shares_of_greatest(means).mean(axis=0)
    return shares


def best_sizes(data: ScalabilityData) -> dict[str, tuple[float, float]]:
    """Return the size of best performance and its probability, of hierarchies with several."""
    best = {}
    for name in data.hierarchies:
        sizes = data.sizes(name)
        values = data.sign * paired([data.performances[name, n] for n in sizes])
        if len(values) > 1 and len(sizes) > 1:
            k = int(values.mean(axis=0).argmax())
            best[name] = sizes[k], float(probability_of_best(values)[k])
    return best


def best_hierarchies(data: ScalabilityData) -> tuple[tuple[str, ...], float] | None:
    """Return the best at the largest size, or several that tie, and how probable that is.

    None without two hierarchies and two seeds there.
    """
    names, (values,) = data.paired_at(data.all_sizes[-1], [])
    if len(names) < 2 or len(values) < 2:
        return None
    values = data.sign * values
    best = np.flatnonzero(are_greatest(values.mean(axis=0))).tolist()
    probability = float(probability_of_best(values)[best].sum())
    return tuple(names[k] for k in best), probability


def differences_by_size(data: ScalabilityData, one: str, other: str) -> pd.DataFrame:
    """Return how much better one hierarchy is than another, by shared seed and shared size."""
    sizes = [n for n in data.sizes(one) if n in data.sizes(other)]
    values = paired([data.performances[name, n] for name in (one, other) for n in sizes])
    differences = data.sign * (values[:, : len(sizes)] - values[:, len(sizes) :])
    return pd.DataFrame(differences, columns=sizes)


def can_cross(differences: pd.DataFrame) -> bool:
    """Return whether differences have the two seeds and two sizes that a crossover takes."""
    return min(differences.shape) > 1


def crossovers(data: ScalabilityData) -> list[tuple[str, str, Estimate]]:
    """Return better and worse hierarchy, and the size from which on, of all pairs that cross."""
    changes = []
    for better, worse in permutations(data.hierarchies, 2):
        differences = differences_by_size(data, better, worse)
        if can_cross(differences):
            size = sign_change([*differences], differences.to_numpy())
            changes += [(better, worse, size)] if size is not None else []
    return changes
