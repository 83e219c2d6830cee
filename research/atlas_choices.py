"""Which hierarchy is best for large teams, as laws of small ones have it.

A case is a task, a learner and what fails. Hierarchies are ranked by the quality of the task at
the largest size at which all were run. The rule chooses the one of the greatest prediction. Its
choice is decided if the 90% interval of what it is better by lies above zero, beside each other
hierarchy: that is a law of its own, fitted to differences of the same seeds. Only cases count in
which one hierarchy is significantly better than each other: paired by seed, adjusted by Holm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from nested_agents import rate
from nested_agents.analysis import LEVEL, fitting, format_estimate, format_p, paired_tests
from nested_agents.analysis import samples as samples_of_laws

from .atlas_predictions import largest_small
from .atlas_rows import MEASURES, NO_FAULT, quality, sample_of

CASE = ["task", "learner", "fault"]
"""Columns of which every combination is a case."""
TAIL = 0.05
"""Beyond either end of an interval of 90%."""


class HierarchyChoice(NamedTuple):
    """Which hierarchy is best for the largest teams of a case, as predicted and as measured."""

    case: tuple[str, str, str]
    measure: str
    size: int
    predicted: str
    """The best by the laws of small teams."""
    rivals: tuple[str, ...]
    """Those of which the laws leave open whether they are as good; empty: it is decided."""
    nearest: str
    """The best of the largest small teams."""
    measured: str
    p: float
    """The greatest p that the best measured differs from another one, adjusted."""

    @property
    def is_clear(self) -> bool:
        """Whether one hierarchy was significantly better than all others."""
        return self.p < LEVEL

    @property
    def verdict(self) -> str:
        """``right``, ``wrong`` or ``not decided``, by what was measured."""
        if self.rivals:
            return "not decided"
        return "right" if self.predicted == self.measured else "wrong"

    def __str__(self) -> str:
        task, learner, fault = self.case
        failing = [fault] if fault != NO_FAULT else []
        names = " or ".join([self.predicted, *self.rivals])
        head = ", ".join([task, learner, *failing, MEASURES[self.measure], f"{self.size} agents"])
        return f"{head}: {names} predicted, {self.measured} was best (p {format_p(self.p)})"


def choices(rows: pd.DataFrame) -> list[HierarchyChoice]:
    """Return for every case the best hierarchy as laws of small teams have it."""
    chosen = []
    for (task, learner, fault), own in rows.groupby(CASE, sort=False):
        case = (str(task), str(learner), str(fault))
        measure = quality(case[0])
        if measure in own:
            known = own[own[measure].notna()]
            choice = _choice(case, known, measure, largest_small(case[0]))
            chosen += [choice] if choice is not None else []
    return chosen


def _choice(
    case: tuple[str, str, str], rows: pd.DataFrame, measure: str, small: int
) -> HierarchyChoice | None:
    """Return the choice of a case; None if fewer than two hierarchies have a law."""
    means = rows.pivot_table(index="seed", columns=["size", "hierarchy"], values=measure).dropna()
    rows = rows[rows["seed"].isin(means.index)]
    samples = {}
    for hierarchy, own in rows[rows["size"] <= small].groupby("hierarchy", sort=False):
        sample = sample_of(own, measure)
        if sample is not None and len(sample.sizes) >= fitting.FEWEST and len(sample.values) > 1:
            samples[str(hierarchy)] = sample
    if len(samples) < 2:
        return None
    sizes = [int(n) for n in rows["size"].unique() if set(samples) <= set(means[n].columns)]
    size = max(sizes, default=0)
    if size <= small:
        return None
    at = means[size][list(samples)]
    best = str(at.mean().idxmax())
    others = [hierarchy for hierarchy in samples if hierarchy != best]
    tests = paired_tests([(at[best].to_numpy(), at[other].to_numpy()) for other in others])
    median = {h: fitting.choose(own).distribution(size).quantile(0.5) for h, own in samples.items()}
    predicted = max(median, key=lambda h: median[h])
    rivals = [h for h in samples if h != predicted and not _is_above(samples, predicted, h, size)]
    nearest = means[max(n for n in sizes if n <= small)][list(samples)].mean().idxmax()
    p = max(adjusted for _, adjusted in tests)
    return HierarchyChoice(case, measure, size, predicted, tuple(rivals), str(nearest), best, p)


def _is_above(
    samples: Mapping[str, samples_of_laws.Sample], one: str, other: str, size: int
) -> bool:
    """Return whether one hierarchy is better than another, by the 90% interval of its lead."""
    lead = fitting.choose(samples_of_laws.apart(samples[one], samples[other]))
    return lead.distribution(size).quantile(TAIL) > 0.0


def shares_right(chosen: Sequence[HierarchyChoice]) -> list[str]:
    """Return how often the best hierarchy was predicted where one was significantly the best."""
    clear = [choice for choice in chosen if choice.is_clear]
    head = f"{len(chosen)} cases, {len(clear) or 'none'} with one significantly the best"
    if not clear:
        return [head]
    verdicts = [choice.verdict for choice in clear]
    counts = ", ".join(f"{verdicts.count(v)} {v}" for v in ("right", "wrong", "not decided"))
    shares = {
        "decided and right": [verdict == "right" for verdict in verdicts],
        "the greatest prediction": [choice.predicted == choice.measured for choice in clear],
        "the best of the largest small teams": [c.nearest == c.measured for c in clear],
    }
    lines = [f"{head}: {counts}"]
    for name, outcomes in shares.items():
        share = rate(np.array(outcomes)[:, None])
        lines.append(f"{name}: {sum(outcomes)} of {len(clear)}, {format_estimate(share)}")
    return lines
