"""The learning-curve study: how the agents fare from episode to episode (Fig. 5 and 6).

Every claim of learning needs controls: one with frozen weights distinguishes learning from luck,
one that has the reward function distinguishes it from planning with the predictor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ....core.interface.measures import RETURN, SUCCESS, Measure
from ...errors import SpecError
from ...results.analysis import (
    Analysis,
    Figures,
    Summary,
    estimate_of,
    evaluated,
    left_out_lines,
    mean_estimate,
)
from ...results.measured import values_by_seed
from ...results.results import Array, Results
from ...results.statistics import Estimate, bootstrap, rates
from ..study import measure as measure

if TYPE_CHECKING:
    from ...spec.spec import Spec

BLOCK = 5
"""Episodes at each end of training that the table averages over."""
BLOCKS = {"first": slice(BLOCK), "last": slice(-BLOCK, None), "evaluation": slice(None)}
"""The episodes that the table averages over, of training or of evaluation, by name."""
UNEQUAL = "Seeds trained for different numbers of episodes; curves end with the shortest."
COLUMNS = 3
"""Panels in a row of the figure; four panels are a square."""


def check(spec: Spec) -> None:
    """Raise `SpecError` if something is to fail after the last episode of training."""
    for condition in spec.conditions():
        for onset, _ in condition.settings.scenario.failure_spans:
            if onset >= spec.episodes:
                raise SpecError(
                    f"scenario.failures: one begins in episode {onset}, allowed 0 to "
                    f"{spec.episodes - 1} of {spec.episodes} episodes "
                    f"(condition {condition.label!r})"
                )


Metric = tuple[str, Measure, str]
"""Heading of a column of the table, its measure, and one of `BLOCKS`."""


def metrics_of(
    measures: Sequence[Measure], main: Measure, steps: Measure, episodes: int
) -> tuple[Metric, ...]:
    """Return the columns of the table, given the measures of an episode and their number.

    The main measure has columns for the first and last block of training and for the evaluation;
    other measures, except rates, have one column, for the last block of training.
    """
    title = main.heading
    return (
        *[(f"{title} first {BLOCK}", main, "first")] * (episodes > BLOCK),
        (last_title(title, episodes), main, "last"),
        (f"evaluation {title}", main, "evaluation"),
        ("evaluation steps", steps, "evaluation"),
        *(
            (replace(m, title=last_title(m.title, episodes)).heading, m, "last")
            for m in measures
            if m.name != SUCCESS.name and not m.is_rate
        ),
    )


def last_title(title: str, episodes: int) -> str:
    """Return the heading of the mean of the last `BLOCK` episodes of training.

    >>> last_title("success", 20), last_title("success", 3)
    ('success last 5', 'training success')
    """
    return f"{title} last {BLOCK}" if episodes >= BLOCK else f"training {title}"


def curves_of(measure: Measure, training: Mapping[str, Array]) -> dict[str, Estimate]:
    """Return estimates ``(n_episodes,)`` over seeds by condition; of thousands they take seconds.

    `training` holds by condition what was measured ``(n_seeds, n_episodes)``.
    """
    if measure.is_rate:
        return {condition: rates(values) for condition, values in training.items()}
    return {c: bootstrap(values, bounds=measure.bounds) for c, values in training.items()}


def analyse(results: Results) -> Analysis:
    """Estimate the table and what the curves need; seeds are the unit of sampling."""
    conditions = results.of_phase("training")
    if not conditions:
        return _of_evaluations(results)
    table = []
    measures = results.measures or (RETURN,)  # foreign ones may have the return alone
    main = results.main
    for condition in conditions:
        estimates: dict[str, Estimate] = {}
        episodes = results.by_seed(condition, "training", main.name).shape[1]
        for title, m, block in metrics_of(measures, main, results.steps("evaluation"), episodes):
            phase = "evaluation" if block == "evaluation" else "training"
            if results.has(condition, phase, m.name):  # published results keep a part
                estimates[title] = estimate_of(results, condition, phase, m, BLOCKS[block])
            if title == f"evaluation {main.heading}":
                estimates |= evaluated(results, condition)
        table.append(Summary(condition, len(results.seeds(condition)), estimates))
    followed = []
    for m in dict.fromkeys((main, *measures)):
        own = [c for c in conditions if results.has(c, "training", m.name)]
        if own and (m == main or not m.is_rate):
            values = {c: results.values(c, m.name) for c in own}
            followed.append((m, values))
    is_ragged = any(np.isnan(v).any() for _, values in followed for v in values.values())
    notes = (*left_out_lines(results, "training"), *(UNEQUAL,) * is_ragged)
    return Analysis(tuple(table), notes, followed)


def _of_evaluations(results: Results) -> Analysis:
    """Estimate what was measured after training: results of other tools may have no more."""
    estimates: dict[str, dict[str, Estimate]] = {c: {} for c in results.conditions}
    for m in results.measures if results.conditions else ():
        _, values, _ = values_by_seed(results, m.name)
        for condition, own in values.items():
            estimates[condition][m.heading] = mean_estimate(m, own)
    return Analysis(
        tuple(Summary(c, len(results.seeds(c)), own) for c, own in estimates.items() if own)
    )


def draw(analysis: Analysis) -> Figures:
    """Return the figure, a panel for every measure that is followed.

    Lines are means over seeds, bands their 95% intervals. A condition has a color and a style of
    line of its own, so that lines upon each other are distinguished.
    """
    from ...presentation import figures as f  # matplotlib takes its time

    followed = analysis.cases
    if not followed:
        return {}
    columns = 2 if len(followed) == 4 else COLUMNS
    figure, panels = f.grid(len(followed), columns, (2.8, 2.1), (0.0, 1.0), 7.2, sharex=True)
    seeds = {line.condition: line.seeds for line in analysis.table}
    for axes, (measured, training) in zip(panels.flat, followed, strict=False):
        complete = {c: v[:, ~np.isnan(v).any(axis=0)] for c, v in training.items()}
        for condition, curve in curves_of(measured, complete).items():
            episodes = range(len(curve.value))  # counted from 0, as in rows and specs
            band = 0.12 if curve.value.any() else 0.0  # those that never succeed share one band
            index = list(seeds).index(condition)
            f.draw_curve(axes, episodes, curve, index, alpha=band)
        axes.set_title(measured.heading, loc="left")
        if measured.is_rate:
            f.as_rates(axes)
        else:
            axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.grid(axis="y", alpha=0.25)
        f.as_episodes(axes)
    same = len(set(seeds.values())) == 1
    labels = [c if same else f"{c} ({n} seeds)" for c, n in seeds.items()]
    note = f"mean over {next(iter(seeds.values()))} seeds" if same else "mean over seeds"
    f.name_curves(figure, labels, f"{note}, band: 95% interval")
    return {"learning-curves": figure}
