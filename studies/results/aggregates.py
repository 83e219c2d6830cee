"""Statistics of runs that the field reports beside means (Agarwal et al. 2021).

These are the interquartile mean of all runs, the probability that a run betters one of the
reference, and the share of runs above every threshold. Runs are resampled within tasks: within
groups of conditions that are compared with each other. Intervals are percentiles, those of the
authors' library rliable; where all runs of a task ended alike, they have no width there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.numerics import stats
from ..errors import SpecError
from .analysis import Summary
from .contrasts import Contrasts
from .statistics import Array, Estimate, blocks, draw_runs, stack_estimates

RESAMPLES = 2000
THRESHOLDS = 51
"""Points of a performance profile."""

Tasks = Sequence[Array]
"""Scores ``(..., n_runs)`` of each task, which may differ in their number of runs."""


def interquartile_mean(tasks: Tasks) -> Array:
    """Return the mean of all runs' scores without the highest and the lowest quarter.

    Examples
    --------
    >>> float(interquartile_mean([np.array([0.0, 1.0, 2.0, 9.0])]))
    1.5
    """
    return np.asarray(stats.trim_mean(np.concatenate(tasks, axis=-1), 0.25, axis=-1))


def probability_of_improvement(tasks: Tasks) -> Array:
    """Return how often a run scores higher than one of the reference; ties count half.

    Parameters
    ----------
    tasks
        Those of the one, then those of the reference: the mean over tasks is returned.

    Examples
    --------
    >>> float(probability_of_improvement([np.array([1.0, 3.0]), np.array([0.0, 1.0])]))
    0.875
    """
    half = len(tasks) // 2
    each = []
    for own, base in zip(tasks[:half], tasks[half:], strict=True):
        n = own.shape[-1]
        m = base.shape[-1]
        ranks = stats.rankdata(np.concatenate([own, base], axis=-1), axis=-1)[..., :n]
        each.append((ranks.sum(axis=-1) - n * (n + 1) / 2.0) / (n * m))  # Mann and Whitney's U
    return np.mean(each, axis=0)


def stratified_bootstrap(tasks: Tasks, statistic: Callable[[Tasks], Array]) -> Estimate:
    """Return a statistic of tasks with its 95% percentiles, runs resampled within each task.

    Parameters
    ----------
    tasks
        Scores ``(n_runs,)`` of each task.
    statistic
        Of tasks; resamples are along the first axis of each.
    """
    sizes = tuple(map(len, tasks))
    parts = [
        statistic([own[runs[rows]] for own, runs in zip(tasks, _drawn(sizes), strict=True)])
        for rows in blocks(RESAMPLES, sum(sizes))
    ]
    tail = 0.5 - 0.95 / 2.0
    low, high = np.quantile(np.concatenate(parts), [tail, 1.0 - tail], axis=0)
    return Estimate(statistic(tasks), low, high)


@lru_cache(maxsize=2)
def _drawn(sizes: tuple[int, ...]) -> list[NDArray[Any]]:
    """Return the runs that resamples of tasks of so many runs are made of; see `draw_runs`."""
    rng = np.random.default_rng(0)
    return [draw_runs(rng, size, RESAMPLES) for size in sizes]


@dataclass(frozen=True)
class Aggregates:
    """Conditions by the statistics of the field, aggregated over tasks."""

    title: str
    """What was measured."""
    table: tuple[Summary, ...]
    """A line for each condition, the reference first."""
    thresholds: Array
    """``(k,)`` scores."""
    notes: tuple[str, ...]
    """What the columns are."""
    scores: Mapping[str, Tasks] = field(repr=False)
    """By condition, the runs of each task."""
    training: Mapping[str, Tasks] = field(repr=False)
    """By condition, of each task ``(n_runs, n_episodes)``; empty if it is not measured there."""

    @cached_property
    def profiles(self) -> dict[str, Estimate]:
        """By condition, the share of runs above each threshold ``(k,)``."""
        return {name: _profile(own, self.thresholds) for name, own in self.scores.items()}

    @cached_property
    def curves(self) -> dict[str, Estimate]:
        """By condition, the interquartile mean in each episode of training; of many it takes time.

        Empty if it is not measured there.
        """
        return {name: _curve(own) for name, own in self.training.items()}


def aggregate(contrasts: Contrasts) -> Aggregates:
    """Return the statistics of the conditions that are compared; tasks are its groups.

    Raises
    ------
    SpecError
        If no task has all conditions, each with two runs.
    """
    names = list(dict.fromkeys(name for group in contrasts.groups for name in group.values))
    groups = [g for g in contrasts.groups if all(len(g.values.get(n, ())) > 1 for n in names)]
    if len(names) < 2 or not groups:
        raise SpecError("statistics: no two conditions have two seeds each in a task of all")
    scores = {name: [group.values[name] for group in groups] for name in names}
    every = np.concatenate([runs for own in scores.values() for runs in own])
    thresholds = np.linspace(every.min(), every.max(), THRESHOLDS)
    reference = scores[names[0]]
    sign = -1.0 if contrasts.measure.better == "lower" else 1.0
    table = []
    for name, own in scores.items():
        estimates = {"interquartile mean": stratified_bootstrap(own, interquartile_mean)}
        if name != names[0]:
            both = [sign * runs for runs in (*own, *reference)]
            estimates["P(improvement)"] = stratified_bootstrap(both, probability_of_improvement)
        table.append(Summary(name, sum(map(len, own)), estimates))
    is_trained = all(name in group.training for group in groups for name in names)
    trained = names if is_trained else []
    return Aggregates(
        title=contrasts.title,
        table=tuple(table),
        thresholds=thresholds,
        scores=scores,
        training={name: [g.training[name] for g in groups] for name in trained},
        notes=(
            f"{contrasts.title}. Intervals: percentiles, seeds resampled within "
            f"{len(groups)} of {len(contrasts.groups)} tasks.",
            f"P(improvement): that a seed does better than one of {names[0]}, ties half.",
        ),
    )


def _profile(tasks: Tasks, thresholds: Array) -> Estimate:
    """Return the share of runs that score above each threshold, the mean over tasks."""

    def above(drawn: Tasks) -> Array:
        shares = [[(own > t).mean(axis=-1) for t in thresholds] for own in drawn]
        return np.moveaxis(np.mean(shares, axis=0), 0, -1)

    return stratified_bootstrap(tasks, above)


def _curve(tasks: Tasks) -> Estimate:
    """Return the interquartile mean in each episode, of scores ``(n_runs, n_episodes)``."""
    episodes = range(min(own.shape[1] for own in tasks))
    return stack_estimates(
        [stratified_bootstrap([own[:, k] for own in tasks], interquartile_mean) for k in episodes]
    )
