"""What faults cost, and from which share of messages or members on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from nested_agents import bootstrap
from nested_agents.analysis import LEVEL, Estimate, format_estimate, format_number, format_p, holm

from .atlas_rows import MEASURES, NO_FAULT, TeamKind, quality

DOSES = {"lost": "messages lost", "left": "members gone"}
"""With what the name of a fault begins that is a share of something."""


class FaultCost(NamedTuple):
    """What a fault costs."""

    task: str
    hierarchy: str
    learner: str
    size: int
    fault: str
    measure: str
    difference: Estimate
    """Of quality, from no fault, with its 95% interval over seeds."""
    p: float
    """Adjusted by Holm over a task's comparisons."""

    def __str__(self) -> str:
        head = ", ".join([*self[:3], f"{self.size} agents", self.fault])
        shown = format_estimate(self.difference, signed=True)
        return f"{head}: {MEASURES[self.measure]} {shown}, p {format_p(self.p)}"


def fault_costs(rows: pd.DataFrame) -> list[FaultCost]:
    """Return what faults cost in the quality of a task, at the largest size, by hierarchy.

    Raises
    ------
    ValueError
        If a team has a seed twice: rows of two studies.
    """
    lines = []
    for task, own in rows.groupby("task", sort=False):
        measure = quality(str(task))
        if measure in own:
            lines += _holm(list(_fault_costs(str(task), own, measure)))
    return lines


def _fault_costs(task: str, rows: pd.DataFrame, measure: str) -> Iterator[FaultCost]:
    whole = rows[rows["fault"] == NO_FAULT]
    failing = rows[rows["fault"] != NO_FAULT]
    for (hierarchy, learner, fault), own in failing.groupby(list(TeamKind._fields[1:]), sort=False):
        size = int(own["size"].max())
        places = (whole["hierarchy"] == hierarchy) & (whole["size"] == size)
        same = whole[places & (whole["learner"] == learner)]
        pairs = own[own["size"] == size].merge(same, on="seed", validate="1:1")
        each = (pairs[f"{measure}_x"] - pairs[f"{measure}_y"]).dropna().to_numpy(dtype=float)
        if len(each) < 2 or not each.any():  # no messages, which could fail
            continue
        p = float(stats.ttest_1samp(each, 0.0).pvalue) if np.ptp(each) > 0.0 else 1.0
        names = str(hierarchy), str(learner), size, str(fault)
        yield FaultCost(task, *names, measure, bootstrap(each), p)


def _holm(lines: Sequence[FaultCost]) -> list[FaultCost]:
    if not lines:
        return []
    adjusted = holm([line.p for line in lines])
    return [line._replace(p=float(p)) for line, p in zip(lines, adjusted, strict=True)]


def thresholds(costs: Sequence[FaultCost]) -> list[str]:
    """Return from which share on a fault costs significantly, of those that were run."""
    doses = dict[tuple[str, str, str, int, str], list[tuple[float, float]]]()
    for cost in costs:
        kind, _, share = cost.fault.partition(" ")
        if kind in DOSES:
            key = *cost[:4], kind
            doses.setdefault(key, []).append((float(share), cost.p))
    lines = []
    for (task, hierarchy, learner, size, kind), own in doses.items():
        own.sort()
        costly = [share for share, p in own if p < LEVEL]
        free = [share for share, _ in own if not costly or share < costly[0]]
        ends = f"not up to {format_number(free[-1])}" if free else ""
        begins = f"from {format_number(costly[0])} on" if costly else ""
        text = ", ".join(part for part in (begins, ends) if part)
        head = ", ".join([task, hierarchy, learner, f"{size} agents", DOSES[kind]])
        lines.append(f"{head}: costs {text}")
    return lines
