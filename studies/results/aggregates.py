"""Statistics of runs over several tasks (Agarwal et al. 2021).

These are the interquartile mean of all runs, the probability of improvement over the reference, and
performance profiles: the share of runs above every threshold. Tasks are the groups of a comparison.
Runs are resampled within tasks; intervals are percentiles, as in the authors' library rliable.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...core.numerics import stats
from ..errors import SpecError
from .analysis import Summary
from .comparison import ComparisonTable
from .statistics import Array, Estimate, blocks, probability_higher, stack_estimates

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


@dataclass(frozen=True)
class Aggregates:
    """Statistics of conditions over tasks."""

    title: str
    """Title of the measure."""
    table: tuple[Summary, ...]
    """A line for each condition, the reference first."""
    thresholds: Array
    """``(k,)`` scores."""
    notes: tuple[str, ...]
    """Meaning of the columns, in lines."""
    scores: Mapping[str, Tasks] = field(repr=False)
    """Runs of each task by condition."""
    training: Mapping[str, Tasks] = field(repr=False)
    """Scores ``(n_runs, n_episodes)`` of each task by condition; empty if not measured."""

    @cached_property
    def profiles(self) -> dict[str, Estimate]:
        """Share of runs above each threshold ``(k,)`` by condition."""
        return {name: _profile(own, self.thresholds) for name, own in self.scores.items()}

    @cached_property
    def curves(self) -> dict[str, Estimate]:
        """Interquartile mean in each training episode by condition; empty if not measured."""
        return {name: _curve(own) for name, own in self.training.items()}


def aggregate(compared: ComparisonTable) -> Aggregates:
    """Return the statistics of compared conditions; tasks are the groups of the comparison.

    Raises
    ------
    SpecError
        If no task has all conditions with two runs each.
    """
    names = list(dict.fromkeys(name for group in compared.groups for name in group.values))
    groups = [g for g in compared.groups if all(len(g.values.get(n, ())) > 1 for n in names)]
    if len(names) < 2 or not groups:
        raise SpecError("statistics: no two conditions have two seeds each in a task of all")
    scores = {name: [group.values[name] for group in groups] for name in names}
    every = np.concatenate([runs for own in scores.values() for runs in own])
    reference = names[0]
    table = []
    for name, own in scores.items():
        estimates = {"interquartile mean": stratified_bootstrap(own, interquartile_mean)}
        if name != reference:
            both = (scores[reference], own)
            worse, better = both[::-1] if compared.measure.better == "lower" else both
            pairs = list(zip(better, worse, strict=True))
            estimates["P(improvement)"] = probability_higher(pairs)
        table.append(Summary(name, sum(map(len, own)), estimates))
    measure = compared.measure.name
    labels = {name: [group.members[name] for group in groups] for name in names}
    is_trained = compared.phase and all(
        compared.results.has(label, "training", measure) for own in labels.values() for label in own
    )
    training = {
        name: [
            compared.results.by_seed(label, "training", measure).dropna(axis=1).to_numpy()
            for label in own
        ]
        for name, own in labels.items()
        if is_trained
    }
    return Aggregates(
        title=compared.title,
        table=tuple(table),
        thresholds=np.linspace(every.min(), every.max(), THRESHOLDS),
        scores=scores,
        training=training,
        notes=(
            f"{compared.title}. Intervals: percentiles, seeds resampled within "
            f"{len(groups)} of {len(compared.groups)} tasks.",
            f"P(improvement): probability that a seed does better than one of {reference}; ties "
            "count half.",
        ),
    )


def _profile(tasks: Tasks, thresholds: Array) -> Estimate:
    """Return the share of runs above each threshold, the mean over tasks."""

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
