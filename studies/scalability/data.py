"""Values of hierarchies by size and seed: performance, time of the task, and costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...core.interface.measures import Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..laws.scaling import decisions_to_criterion
from ..laws.size_axis import SizeAxis
from ..laws.universal import Scaling
from ..results.analysis import estimate_of, mean_estimate
from ..results.differences import BySeed
from ..results.measured import title_of, trial_numbers, values_of
from ..results.results import Results
from ..results.statistics import Array, Estimate

ALL_TEAMS = "all teams"
"""Name of the only hierarchy of a study that varies nothing but the size."""
DECISIONS = "decisions"
"""Name of the cost of training: decisions until the criterion is reached."""
HEADINGS = {
    "decision_ms": "decision time [ms]",
    "messages": "messages",
    "joint_actions": "joint actions",
    "compute_s": "computing time [s]",
    DECISIONS: "decisions to criterion",
}
"""Headings of costs by name; messages and joint actions tried are those of one decision."""
NUMBERS = {
    "decision_ms": "decision_median",
    "messages": "messages",
    "joint_actions": "joint_actions",
    "compute_s": "total",
}
"""Numbers of trials that are costs, by the name of the cost."""
TIME = "steps"
"""Measure of the time of a task: decisions of an episode."""
Place: TypeAlias = tuple[str, float]
"""A hierarchy and a size."""
Cells: TypeAlias = Mapping[Place, pd.Series]
"""Values by seed, by hierarchy and size."""


@dataclass(frozen=True)
class ScalabilityData:
    """Measured values of every hierarchy at every size."""

    size: str
    """Name of the size, such as ``robots``."""
    scaling: Scaling | None
    """Whether the task stays the same or grows in proportion to the team; None: neither."""
    performance: Measure
    performance_title: str
    performances: Cells
    performance_estimates: Mapping[Place, Estimate]
    """Means with the intervals of the study's table."""
    times: Cells
    """Decisions until success, see `values_by_seed`. Missing where all episodes failed, or where
    nothing is a success."""
    costs: Mapping[str, Cells]
    """By the name of the cost, see `HEADINGS`."""
    has_criterion: bool = False
    """Whether the decisions to a criterion are among the costs, as far as all seeds reach it."""

    @property
    def sign(self) -> float:
        """Factor that makes higher values of the performance better."""
        return -1.0 if self.performance.better == "lower" else 1.0

    @property
    def hierarchies(self) -> tuple[str, ...]:
        """Names of the hierarchies, or of whatever else the conditions differ in."""
        return tuple(dict.fromkeys(name for name, _ in self.performances))

    def sizes(self, hierarchy: str) -> tuple[float, ...]:
        """Return the sizes at which a hierarchy was measured, in increasing order."""
        return tuple(sorted(n for name, n in self.performances if name == hierarchy))

    @property
    def all_sizes(self) -> tuple[float, ...]:
        """All sizes in increasing order."""
        return tuple(sorted({n for _, n in self.performances}))

    def at_size(self, size: float) -> tuple[str, ...]:
        """Return the hierarchies that were measured at a size."""
        return tuple(name for name in self.hierarchies if (name, size) in self.performances)

    def paired_at(
        self, size: float, measured: Sequence[Cells]
    ) -> tuple[tuple[str, ...], list[Array]]:
        """Return the hierarchies at a size with all of some values, and their values.

        Performance and the other values ``(n_seeds, n_hierarchies)`` are those of the seeds that
        all share.
        """
        groups = [self.performances, *measured]
        here = self.at_size(size)
        names = tuple(name for name in here if all((name, size) in cells for cells in measured))
        columns = [cells[name, size] for cells in groups for name in names]
        return names, np.split(paired(columns), len(groups), axis=1)

    def times_of(self, hierarchy: str) -> pd.DataFrame | None:
        """Return times by seed and size of the seeds that ran at all sizes; None of fewer than two.

        There are no times, either, if those of a size are missing.
        """
        sizes = self.sizes(hierarchy)
        known = {n: self.times[hierarchy, n] for n in sizes if (hierarchy, n) in self.times}
        times = pd.DataFrame(known).dropna()
        is_known = len(known) == len(sizes) and len(times) > 1
        return times if is_known and (times > 0.0).all(axis=None) else None


def paired(columns: Sequence[pd.Series]) -> Array:
    """Return the values of the seeds that all columns have, ``(n_seeds, n_columns)``."""
    if not columns:
        return np.empty((0, 0))
    return pd.concat(columns, axis=1, join="inner").dropna().to_numpy(dtype=float)


def collect(
    results: Results,
    scaling: Scaling | None,
    *,
    measure: str,
    size: str | None = None,
    criterion: float | None = None,
) -> ScalabilityData:
    """Collect performance, times and costs of every hierarchy at every size.

    Parameters
    ----------
    results
        Results of a study that sweeps the team size, a key with numbers.
    scaling
        Whether the task stays the same or grows in proportion to the team; None: neither.
    measure
        Name of the measure of performance.
    size
        The swept key, or its last part; by default the number of robots or agents.
    criterion
        Share of episodes in a row that must succeed for the cost `DECISIONS`, which is known where
        all seeds reach it; None: not measured.

    Raises
    ------
    SpecError
        If there is no such measure or size, or only one size; one line.
    """
    axis = SizeAxis.of(results, size)
    places = {condition: (name or ALL_TEAMS, n) for condition, (name, n) in axis.places.items()}
    shown_as, values, phase = values_of(results, measure)
    performances = _cells(values, places)
    if len({n for _, n in performances}) < 2:
        raise SpecError(f"size = {axis.key!r}: one size; scalability needs two or more")
    costs = {}
    for cost, number in NUMBERS.items():
        with suppress(SpecError):  # was not measured
            _, frames, _ = trial_numbers(results, number)
            costs[cost] = _cells({c: own.iloc[:, 0] for c, own in frames.items()}, places)
    times: Cells = {}
    with suppress(SpecError):  # was not measured
        times = _cells(_times(results, phase), places)
    if criterion is not None:
        reached = decisions_to_criterion(results, measure, criterion)
        counts = {c: own for c, (own, censored) in reached.items() if not censored.any()}
        costs |= {DECISIONS: _cells(counts, places)} if counts else {}
    return ScalabilityData(
        size=axis.name,
        scaling=scaling,
        performance=shown_as,
        performance_title=title_of(shown_as, phase),
        performances=performances,
        performance_estimates={
            places[condition]: estimate_of(results, condition, phase, shown_as)
            if phase
            else mean_estimate(shown_as, pd.DataFrame(own))
            for condition, own in values.items()
        },
        times=times,
        costs=costs,
        has_criterion=criterion is not None,
    )


def _times(results: Results, phase: str) -> dict[str, BySeed]:
    """Return the times of conditions by seed, see `ScalabilityData.times`."""
    steps, values, _ = values_of(results, TIME, phase or None)
    limit = steps.bounds[1] if steps.better else 0.0  # without success, nothing is known of times
    return {condition: own for condition, own in values.items() if own.min() < limit}


def _cells(values: Mapping[str, BySeed], places: Mapping[str, Place]) -> Cells:
    """Return values by hierarchy and size; refuse two conditions in one place."""
    cells: dict[Place, pd.Series] = {}
    for condition, own in values.items():
        if places[condition] in cells:
            name, n = places[condition]
            raise SpecError(
                f"size: {name} has two conditions at {n:g}; name conditions by what they differ in"
            )
        cells[places[condition]] = pd.Series(own)
    return cells


def cost_of(data: ScalabilityData, name: str) -> Cells:
    """Return a cost by its name.

    Raises
    ------
    SpecError
        If it was not measured; one line.
    """
    if name == DECISIONS and not data.costs.get(name):
        raise SpecError(f"cost = {name!r}: needs a criterion that all seeds reach somewhere")
    if name not in data.costs:
        raise SpecError(f"cost = {name!r}: was not measured; {closest(name, data.costs)}")
    return data.costs[name]
