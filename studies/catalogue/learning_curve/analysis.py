"""The learning-curve study: how the agents fare from episode to episode (Fig. 5 and 6).

Every claim of learning needs its controls beside it: one whose weights stay frozen tells learning
from luck, one that has the reward function tells it from what the predictor alone achieves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from ....core.interface.measures import SUCCESS, Measure
from ...results.results import Arrays, Results
from ...results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate, rates
from ...results.summary import EVALUATED, Summary, evaluated

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
        Which measurement: a measure of `Results.measures`, or ``steps``.
    block
        Which episodes: the first or the last `BLOCK` of training, or those of the evaluation.
    is_rate
        Whether each episode is a success or not.
    bounds
        The least and the greatest value that there can be.
    """

    title: str
    measure: str
    block: Literal["first", "last", "evaluation"]
    is_rate: bool = False
    bounds: tuple[float, float] = NOT_NEGATIVE


def metrics_of(measures: Sequence[Measure], episodes: int) -> tuple[Metric, ...]:
    """Return the columns of the table, given what is measured of an episode, and their number.

    Success as it begins, as it ends and when evaluated; how the evaluation fares by other rates
    and how many steps it takes; and every other measure at the end of training. Where training is
    no longer than a block, its begin is its end.
    """
    rates = [m for m in measures if m.is_rate and m.name != SUCCESS.name]
    numbers = [m for m in measures if not m.is_rate and m.name != SUCCESS.name]
    begin = [Metric(f"success first {BLOCK}", SUCCESS.name, "first", is_rate=True)]
    return (
        *(begin if episodes > BLOCK else ()),
        Metric(f"success last {BLOCK}", SUCCESS.name, "last", is_rate=True),
        Metric(EVALUATED, SUCCESS.name, "evaluation", is_rate=True),
        *(Metric(f"{m.title}, evaluation", m.name, "evaluation", is_rate=True) for m in rates),
        Metric("evaluation steps", "steps", "evaluation"),
        *(Metric(m.heading, m.name, "last", bounds=m.bounds) for m in numbers),
    )


@dataclass(frozen=True)
class LearningCurves:
    """The analysis.

    Attributes
    ----------
    table
        One line per condition.
    training
        By condition and measure, what was measured ``(n_seeds, n_episodes)``; of a condition, what
        its scenario has.
    followed
        The measures that are followed from episode to episode: success and all that are no rates.
    """

    table: tuple[Summary, ...]
    training: Mapping[str, Arrays]
    followed: tuple[Measure, ...]

    @cached_property
    def curves(self) -> dict[str, dict[str, Estimate]]:
        """Estimates ``(n_episodes,)`` over seeds of what is followed, by condition and measure.

        They are made when they are first asked for: of thousands of seeds that takes seconds.
        """
        return {
            condition: {
                m.name: rates(training[m.name])
                if m.is_rate
                else bootstrap(training[m.name], bounds=m.bounds)
                for m in self.followed
                if m.name in training
            }
            for condition, training in self.training.items()
        }

    @property
    def headline(self) -> str:
        """The estimate to begin with: success after training, or if not measured at its end."""
        titles = {title for line in self.table for title in line.estimates}
        return EVALUATED if EVALUATED in titles else f"success last {BLOCK}"


def analyse(results: Results) -> LearningCurves:
    """Estimate the table and the curves; 95 % intervals, seeds as the unit of sampling."""
    table = []
    for condition, training in results.training.items():
        evaluation = results.evaluation.get(condition)
        estimates = {}
        for metric in metrics_of(results.measures, training["success"].shape[1]):
            arrays = evaluation if metric.block == "evaluation" else training
            if arrays is None or metric.measure not in arrays:  # published results keep a part
                continue
            block = slice(None, BLOCK) if metric.block == "first" else slice(-BLOCK, None)
            values = arrays[metric.measure]
            values = values if metric.block == "evaluation" else values[:, block]
            estimates[metric.title] = (
                rate(values) if metric.is_rate else bootstrap(_runs(values), bounds=metric.bounds)
            )
            if metric.title == EVALUATED:
                estimates |= evaluated(results, condition)
        table.append(Summary(condition, len(training["success"]), estimates))
    measured = {name for training in results.training.values() for name in training}
    followed = (m for m in results.measures if m.name == SUCCESS.name or not m.is_rate)
    return LearningCurves(
        tuple(table), results.training, tuple(m for m in followed if m.name in measured)
    )


def _runs(values: np.ndarray) -> np.ndarray:
    """Return the mean of each run over its episodes."""
    return np.asarray(values.mean(axis=1))
