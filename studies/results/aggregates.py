"""Statistics of runs over several tasks (Agarwal et al. 2021).

These are the interquartile mean of all runs, the probability of improvement over the reference, and
performance profiles: the share of runs above every threshold. Tasks are the groups of a comparison.
Runs are resampled within tasks; intervals are percentiles, as in the authors' library rliable.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ...core.numerics import stats
from ..errors import SpecError
from .analysis import Summary
from .comparison import ComparisonTable
from .statistics import Array, Estimate, blocks, probability_higher

RESAMPLES = 2000
THRESHOLDS = 51
"""Points of a performance profile."""

Tasks = Sequence[Array]
"""Scores ``(..., n_runs)`` of each task, which may differ in their number of runs."""


def interquartile_mean(tasks: Tasks) -> Array:
    """Return the mean score of all runs without the highest and the lowest quarter.

    Examples
    --------
    >>> float(interquartile_mean([np.array([0.0, 1.0, 2.0, 9.0])]))
    1.5
    """
    return np.asarray(stats.trim_mean(np.concatenate(tasks, axis=-1), 0.25, axis=-1))


def stratified_bootstrap(tasks: Tasks, statistic: Callable[[Tasks], Array]) -> Estimate:
    """Return a statistic of tasks with its 95% percentiles, runs resampled within each task.

    Parameters
    ----------
    tasks
        Scores ``(n_runs,)`` of each task.
    statistic
        Function of tasks; resamples are the first axis of each.
    """
    rng = np.random.default_rng(0)
    drawn = [rng.integers(len(own), size=(RESAMPLES, len(own))) for own in tasks]
    parts = [
        statistic([own[runs[rows]] for own, runs in zip(tasks, drawn, strict=True)])
        for rows in blocks(RESAMPLES, sum(map(len, tasks)))
    ]
    low, high = np.quantile(np.concatenate(parts), [0.025, 0.975], axis=0)
    return Estimate(statistic(tasks), low, high)


def scores_of(compared: ComparisonTable) -> dict[str, Tasks]:
    """Return the runs of each task by condition; tasks are the groups that have all conditions.

    Raises
    ------
    SpecError
        If no task has all conditions with two runs each.
    """
    names = dict.fromkeys(name for group in compared.groups for name in group.values)
    groups = [g for g in compared.groups if all(len(g.values.get(n, ())) > 1 for n in names)]
    if len(names) < 2 or not groups:
        raise SpecError("statistics: no two conditions have two seeds each in a task of all")
    return {name: [group.values[name] for group in groups] for name in names}


def aggregate(compared: ComparisonTable) -> tuple[list[Summary], tuple[str, str]]:
    """Return a line of statistics for each condition, the reference first, and their meaning.

    Raises
    ------
    SpecError
        If no task has all conditions with two runs each.
    """
    scores = scores_of(compared)
    reference, base = next(iter(scores.items()))
    lines = []
    for name, own in scores.items():
        estimates = {"interquartile mean": stratified_bootstrap(own, interquartile_mean)}
        if name != reference:
            pair = (base, own) if compared.measure.better == "lower" else (own, base)
            estimates["P(improvement)"] = probability_higher(list(zip(*pair, strict=True)))
        lines.append(Summary(name, sum(map(len, own)), estimates))
    return lines, (
        f"{compared.title}. Intervals: percentiles, seeds resampled within "
        f"{len(base)} of {len(compared.groups)} tasks.",
        f"P(improvement): probability that a seed does better than one of {reference}; ties count "
        "half.",
    )


def profiles(compared: ComparisonTable) -> tuple[Array, dict[str, Estimate]]:
    """Return thresholds ``(k,)`` and by condition the share of runs above, the mean over tasks."""
    scores = scores_of(compared)
    every = np.concatenate([runs for own in scores.values() for runs in own])
    thresholds = np.linspace(every.min(), every.max(), THRESHOLDS)

    def above(drawn: Tasks) -> Array:
        shares = [[(own > t).mean(axis=-1) for t in thresholds] for own in drawn]
        return np.moveaxis(np.mean(shares, axis=0), 0, -1)

    return thresholds, {name: stratified_bootstrap(own, above) for name, own in scores.items()}
