"""What laws of small teams say of large ones, which they have not seen.

The best hierarchy of large teams is predicted by the same laws: that of the greatest prediction, if
the 90 % interval of what it is better by than each other lies above zero. If not, it is not
decided.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from ..core.numerics import pd, stats
from ..studies.results import laws
from ..studies.results.analysis import format_p
from ..studies.results.notation import bracketed, two_figures
from ..studies.results.statistics import LEVEL, Estimate, bootstrap
from .atlas import COSTS, MEASURES, NO_FAULT, TeamKind, qualities, sample_of

SMALL = 16
"""Agents of the largest teams that laws are fitted to."""
SMALLER = {"landmarks": 4}
"""The same of tasks whose teams are all small."""


class Check(NamedTuple):
    """A law of small teams, and what a larger one did."""

    team: TeamKind
    measure: str
    size: int
    law: str
    """Which law it is."""
    predicted: Estimate
    """The mean of as many seeds, with its 90 % interval."""
    measured: float

    @property
    def is_inside(self) -> bool:
        """Whether the interval has what was measured."""
        return bool(self.predicted.low <= self.measured <= self.predicted.high)


class HierarchyChoice(NamedTuple):
    """Which hierarchy is best for large teams, as predicted and as measured."""

    task: str
    learner: str
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
    """That the best measured differs from the second, paired by seed."""

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
        names = " or ".join([self.predicted, *self.rivals])
        head = f"{self.task}, {self.learner}, {MEASURES[self.measure]}, {self.size} agents: "
        outcome = f"{self.measured} was best (p {format_p(self.p)})"
        return f"{head}{names} predicted, {outcome}"


def checks(rows: pd.DataFrame, most: int = SMALL) -> list[Check]:
    """Return every law of teams of at most `most` agents beside what each larger team did."""
    lines = []
    for (team, own), measure in product(rows.groupby(list(TeamKind._fields), sort=False), MEASURES):
        sample = sample_of(own, measure)
        if sample is None:
            continue
        small = min(most, SMALLER.get(str(team[0]), most))
        m = int((sample.sizes <= small).sum())
        first = sample.first(m)
        if m < laws.FEWEST or m == len(sample.sizes) or np.ptp(first.values) == 0.0:
            continue
        law = laws.choose(first)
        for k in range(m, len(sample.sizes)):
            size = int(sample.sizes[k])
            measured = float(sample.scale.back(sample.values[:, k].mean()))
            predicted = law.predict(size)
            lines.append(Check(TeamKind(*team), measure, size, law.curve.name, predicted, measured))
    return lines


def choices(rows: pd.DataFrame, most: int = SMALL) -> list[HierarchyChoice]:
    """Return for larger teams the best hierarchy as laws of at most `most` agents have it."""
    whole = rows[rows["fault"] == NO_FAULT]
    chosen: list[HierarchyChoice] = []
    for (task, learner), own in whole.groupby(["task", "learner"], sort=False):
        small = min(most, SMALLER.get(str(task), most))
        for measure, sign in qualities(str(task)).items():
            if measure in own:
                known = own[own[measure].notna()]
                chosen += _choices(str(task), str(learner), known, measure, sign, small)
    return chosen


def _choices(
    task: str, learner: str, rows: pd.DataFrame, measure: str, sign: int, small: int
) -> Iterator[HierarchyChoice]:
    by_hierarchy = {}
    for hierarchy, own in rows[rows["size"] <= small].groupby("hierarchy", sort=False):
        sample = sample_of(own, measure)
        if sample is not None and len(sample.sizes) >= laws.FEWEST and len(sample.values) > 1:
            by_hierarchy[str(hierarchy)] = laws.choose(sample)
    means = rows.pivot_table(index="seed", columns=["size", "hierarchy"], values=measure) * sign
    sizes = sorted(int(n) for n in rows["size"].unique())
    for size in (n for n in sizes if n > small):
        at = means[size].dropna()
        fitted = {h: law for h, law in by_hierarchy.items() if h in at}
        if len(fitted) < 2 or len(at) < 2:
            continue
        order = at[list(fitted)].mean().sort_values()
        best, second = str(order.index[-1]), str(order.index[-2])
        apart = (at[best] - at[second]).to_numpy(dtype=float)
        p = float(stats.ttest_1samp(apart, 0.0).pvalue) if np.ptp(apart) > 0.0 else 1.0
        predicted = max(fitted, key=lambda h: sign * fitted[h].distribution(size).quantile(0.5))
        rivals = [
            h for h in fitted if h != predicted and not _is_above(fitted, predicted, h, size, sign)
        ]
        nearest = means[max(n for n in sizes if n <= small)][list(fitted)].mean().idxmax()
        yield HierarchyChoice(
            task, learner, measure, size, predicted, tuple(rivals), str(nearest), best, p
        )


def _is_above(fitted: Mapping[str, laws.Law], one: str, other: str, size: int, sign: int) -> bool:
    """Return whether one hierarchy is better by its law than another, by the 90 % interval."""
    less = fitted[one].less(fitted[other], size)
    return bool((less.low if sign > 0 else -less.high) > 0.0)


def shares_right(chosen: Sequence[HierarchyChoice]) -> list[str]:
    """Return how often the best hierarchy was predicted where one was significantly the best."""
    clear = [choice for choice in chosen if choice.is_clear]
    if not clear:
        return [f"Best hierarchy: {len(chosen)} cases, in none was one significantly the best"]
    verdicts = [choice.verdict for choice in clear]
    right = verdicts.count("right")
    named = sum(choice.predicted == choice.measured for choice in clear)
    nearest = sum(choice.nearest == choice.measured for choice in clear)
    return [
        f"Best hierarchy: {len(chosen)} cases, {len(clear)} with one significantly the best; of "
        f"these decided {len(clear) - verdicts.count('not decided')}, {right} right; the greatest "
        f"prediction, decided or not, {named} right; the best of the largest small teams {nearest}"
    ]


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
        factor = np.median([np.sqrt(c.predicted.high / c.predicted.low) for c in own])
        text = f"{name}: {inside} of {len(own)} inside, {len(shares)} laws"
        if len(shares) > 1:
            text += f", share {bracketed(bootstrap(shares, bounds=(0.0, 1.0)))}"
        lines.append(f"{text}; median factor {two_figures(float(factor))}")
    return lines


def exponents(rows: pd.DataFrame, measure: str) -> dict[TeamKind, Estimate]:
    """Return the first exponent of the law of each team, of all its sizes."""
    by_team = {}
    for team, own in rows.groupby(list(TeamKind._fields), sort=False):
        sample = sample_of(own, measure)
        if sample is None or len(sample.sizes) < laws.FEWEST or len(sample.values) < 2:
            continue
        if np.ptp(sample.values) == 0.0:
            continue
        law = laws.fit(sample.scale.curves[0], sample)
        by_team[TeamKind(*team)] = law.exponents()["exponent"]
    return by_team
