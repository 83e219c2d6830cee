"""The learning-curve study: how the agents fare from episode to episode (Fig. 5 and 6).

Every claim of learning needs its controls beside it: one whose weights stay frozen tells learning
from luck, one that is told the reward tells it from what the predictor alone achieves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...analysis.results import Results
from ...analysis.statistics import Estimate, bootstrap, rate, rates
from ...analysis.summary import Summary

BLOCK = 5
"""Episodes at each end of training that the table averages over."""


@dataclass(frozen=True)
class Metric:
    """A column of the table.

    Attributes
    ----------
    title
        Its heading.
    measure
        Which measurement, see `nested_agents.studies.analysis.results.MEASURES`.
    block
        Which episodes: the first or the last `BLOCK` of training, or those of the evaluation.
    is_rate
        Whether each episode is a success or not.
    """

    title: str
    measure: str
    block: Literal["first", "last", "greedy"]
    is_rate: bool = False


METRICS = (
    Metric(f"success first {BLOCK}", "success", "first", is_rate=True),
    Metric(f"success last {BLOCK}", "success", "last", is_rate=True),
    Metric("success greedy", "success", "greedy", is_rate=True),
    Metric("stopped greedy", "stopped_at_goal", "greedy", is_rate=True),
    Metric("steps greedy", "steps", "greedy"),
    Metric("distance [m]", "final_distance_m", "last"),
    Metric("turned [rad]", "final_orientation_rad", "last"),
    Metric("contact", "contact_fraction", "last"),
)

CURVES = ("success", "final_distance_m", "final_orientation_rad", "contact_fraction")
"""The measures that are followed from episode to episode."""


@dataclass(frozen=True)
class LearningCurves:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    curves
        By condition and measure, estimates ``(n_episodes,)`` over seeds.
    """

    table: tuple[Summary, ...]
    curves: dict[str, dict[str, Estimate]]

    @property
    def headline(self) -> str:
        """The estimate to begin with: success after training, or if not measured at its end."""
        titles = {title for line in self.table for title in line.estimates}
        return "success greedy" if "success greedy" in titles else f"success last {BLOCK}"


def analyse(results: Results) -> LearningCurves:
    """Estimate the table and the curves; 95 % intervals, seeds as the unit of sampling."""
    table = []
    for condition, training in results.training.items():
        evaluation = results.evaluation.get(condition)
        estimates = {}
        for metric in METRICS:
            arrays = evaluation if metric.block == "greedy" else training
            if arrays is None or metric.measure not in arrays:  # published results keep a part
                continue
            block = slice(None, BLOCK) if metric.block == "first" else slice(-BLOCK, None)
            values = arrays[metric.measure]
            values = values if metric.block == "greedy" else values[:, block]
            estimates[metric.title] = rate(values) if metric.is_rate else bootstrap(_runs(values))
        table.append(Summary(condition, len(training["success"]), estimates))
    curves = {
        condition: {
            name: rates(training[name]) if name == "success" else bootstrap(training[name])
            for name in CURVES
            if name in training
        }
        for condition, training in results.training.items()
    }
    return LearningCurves(tuple(table), curves)


def _runs(values: np.ndarray) -> np.ndarray:
    """Return the mean of each run over its episodes."""
    return np.asarray(values.mean(axis=1))
