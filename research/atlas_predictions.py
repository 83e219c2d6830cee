"""What laws of small teams say of large ones, which they have not seen."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from nested_agents import bootstrap
from nested_agents.analysis import Estimate, fitting, format_estimate, format_number

from .atlas_rows import COSTS, MEASURES, TeamKind, sample_of

SMALL = 16
"""Agents of the largest teams that laws are fitted to."""
SMALLER = {"landmarks": 4, "landmarks_more": 4, "permutation": 5, "small_boxes": 4}
"""The same of tasks whose teams are all small."""


def largest_small(task: str, most: int = SMALL) -> int:
    """Return how many agents the largest teams of a task have that laws are fitted to."""
    return min(most, SMALLER.get(task, most))


class Check(NamedTuple):
    """A law of small teams, and what a larger one did."""

    team: TeamKind
    measure: str
    size: int
    law: str
    """Which law it is."""
    predicted: Estimate
    """The mean of as many seeds, with its 90% interval."""
    measured: float

    @property
    def is_inside(self) -> bool:
        """Whether the interval has what was measured."""
        return bool(self.predicted.low <= self.measured <= self.predicted.high)


def checks(rows: pd.DataFrame, most: int = SMALL) -> list[Check]:
    """Return every law of teams of at most `most` agents beside what each larger team did."""
    lines = []
    for (team, own), measure in product(rows.groupby(list(TeamKind._fields), sort=False), MEASURES):
        sample = sample_of(own, measure)
        if sample is None:
            continue
        m = int((sample.sizes <= largest_small(str(team[0]), most)).sum())
        first = sample.first(m)
        if m < fitting.FEWEST or m == len(sample.sizes) or np.ptp(first.observed) == 0.0:
            continue
        law = fitting.choose(first)
        for k in range(m, len(sample.sizes)):
            size = int(sample.sizes[k])
            measured = float(sample.means[k])
            predicted = law.predict(size)
            lines.append(Check(TeamKind(*team), measure, size, law.curve.name, predicted, measured))
    return lines


def coverage(checked: Sequence[Check]) -> list[str]:
    """Return by measure, and of all, which share of predictions held, and how wide they were.

    The intervals of shares are over laws, several of whose sizes stand or fall together.
    """
    lines: list[str] = []
    groups = {
        "all": list(checked),
        "what is achieved": [check for check in checked if check.measure not in COSTS],
        "what it costs": [check for check in checked if check.measure in COSTS],
    }
    for check in checked:
        groups.setdefault(MEASURES[check.measure], []).append(check)
    for name, own in groups.items():
        if not own:
            continue
        by_law = dict[tuple[TeamKind, str], list[bool]]()
        for check in own:
            by_law.setdefault((check.team, check.measure), []).append(check.is_inside)
        shares = np.array([np.mean(inside) for inside in by_law.values()])
        inside = sum(check.is_inside for check in own)
        with np.errstate(divide="ignore"):  # the interval of a rate may begin at 0
            factor = np.median([np.sqrt(c.predicted.high / c.predicted.low) for c in own])
        text = f"{name}: {inside} of {len(own)} inside, {len(shares)} laws"
        if len(shares) > 1:
            text += f", share {format_estimate(bootstrap(shares, bounds=(0.0, 1.0)))}"
        lines.append(f"{text}; median factor {format_number(float(factor))}")
    return lines


def exponents(rows: pd.DataFrame, measure: str) -> dict[TeamKind, Estimate]:
    """Return the first exponent of the law of each team, of all its sizes."""
    by_team = {}
    for team, own in rows.groupby(list(TeamKind._fields), sort=False):
        sample = sample_of(own, measure)
        if sample is None or len(sample.sizes) < fitting.FEWEST or len(sample.values) < 2:
            continue
        if np.ptp(sample.observed) == 0.0:
            continue
        law = fitting.fit(sample.scale.curves[0], sample)
        by_team[TeamKind(*team)] = law.exponents()["exponent"]
    return by_team
