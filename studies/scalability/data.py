"""Values of hierarchies by size and seed: performance, time of the task, and costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.interface.measures import Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..results.comparison import title_of, values_of
from ..results.results import Results
from ..results.scaling_law import columns_of, decisions_to_criterion, size_key
from ..results.statistics import Array
from ..spec.tables import label_but
from .laws import Scaling, Times

COSTS = {
    "decision_ms": "decision_median",
    "messages": "messages",
    "joint_actions": "joint_actions",
    "compute_s": "total",
}
"""Names of costs, and the number of a trial that each is: time of a decision [ms], messages and
joint actions tried per decision, computing time of a trial [s]."""
DECISIONS = "decisions"
"""Cost: decisions of training until the criterion is reached."""
TIME = "steps"
"""Measure of the time of a task: decisions of an episode."""
Cells = Mapping[tuple[str, float], pd.Series]
"""Values by seed, by hierarchy and size."""


@dataclass(frozen=True)
class ScalabilityData:
    """Measured values of every hierarchy at every size."""

    size: str
    """Name of the size, such as ``robots``."""
    scaling: Scaling
    """Whether the task stays the same or grows with the team."""
    performance: Measure
    performance_title: str
    performances: Cells
    times: Cells
    """Decisions of an episode; failed episodes count with the longest that is allowed."""
    costs: Mapping[str, Cells]
    """By the name of the cost, see `COSTS`."""

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

    def times_of(self, hierarchy: str) -> Times | None:
        """Return the times of the seeds that ran at all sizes; None if fewer than two did."""
        sizes = self.sizes(hierarchy)
        values = paired([self.times[hierarchy, n] for n in sizes if (hierarchy, n) in self.times])
        if len(values) < 2 or values.shape[1] != len(sizes) or not (values > 0.0).all():
            return None
        return Times(np.array(sizes), values, self.scaling)


def paired(columns: Sequence[pd.Series]) -> Array:
    """Return the values of the seeds that all columns have, ``(n_seeds, n_columns)``."""
    if not columns:
        return np.empty((0, 0))
    return pd.concat(columns, axis=1, join="inner").dropna().to_numpy(dtype=float)


def collect(
    results: Results,
    scaling: Scaling,
    *,
    measure: str,
    size: str | None = None,
    criterion: float | None = None,
) -> ScalabilityData:
    """Collect performance, times and costs of every hierarchy at every size.

    Parameters
    ----------
    results
        Results of a study whose sizes are a swept key of numbers.
    scaling
        Whether the task stays the same or grows with the team.
    measure
        Name of the measure of performance.
    size
        The swept key, or its last part; by default the only one of numbers.
    criterion
        Share of episodes in a row that must succeed for the cost `DECISIONS`, which is known where
        all seeds reach it; None: not measured.

    Raises
    ------
    SpecError
        If there is no such measure or size, or only one size; one line.
    """
    columns = columns_of(results)
    key = size_key(columns, size)
    places = {
        condition: (label_but(own, [key]) or "all teams", float(str(own[key])))
        for condition, own in columns.items()
    }
    shown_as, values, phase = values_of(results, measure)
    performances = _cells(values, places)
    if len({n for _, n in performances}) < 2:
        raise SpecError(f"size = {key!r}: one size; scalability needs two or more")
    costs = {name: _measured(results, number, None, places) for name, number in COSTS.items()}
    if criterion is not None:
        reached = decisions_to_criterion(results, measure, criterion)
        counts = {c: own for c, (own, censored) in reached.items() if not censored.any()}
        costs[DECISIONS] = _cells(counts, places)
    return ScalabilityData(
        size=key.rpartition(".")[2],
        scaling=scaling,
        performance=shown_as,
        performance_title=title_of(shown_as, phase),
        performances=performances,
        times=_measured(results, TIME, phase or None, places),
        costs={name: cells for name, cells in costs.items() if cells},
    )


def _cells(values: Mapping[str, object], places: Mapping[str, tuple[str, float]]) -> Cells:
    """Return values by hierarchy and size; refuse two conditions in one place."""
    cells: dict[tuple[str, float], pd.Series] = {}
    for condition, own in values.items():
        if places[condition] in cells:
            name, n = places[condition]
            raise SpecError(
                f"size: {name} has two conditions at {n:g}; name conditions by what they differ in"
            )
        cells[places[condition]] = pd.Series(own)
    return cells


def _measured(
    results: Results, name: str, phase: str | None, places: Mapping[str, tuple[str, float]]
) -> Cells:
    """Return a measure or number by hierarchy and size; nothing if it was not measured."""
    try:
        values = values_of(results, name, phase)[1]
    except SpecError:
        return {}
    return _cells(values, places)


def cost_of(data: ScalabilityData, name: str) -> Cells:
    """Return a cost by its name.

    Raises
    ------
    SpecError
        If it was not measured; one line.
    """
    if name not in data.costs:
        raise SpecError(f"cost = {name!r}: {closest(name, data.costs)}; not measured otherwise")
    return data.costs[name]
