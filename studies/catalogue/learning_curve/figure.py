"""The figure of a learning curve: success and all measures that are no rates, by episode."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ....core.interface.measures import Measure
from ...presentation.figures import COLOURS, SETTINGS, STYLES
from ...results.statistics import Estimate
from .analysis import LearningCurves

COLUMNS = 2


def figure_of(analysis: LearningCurves) -> Figure:
    """Return the figure, a panel for every measure that is followed.

    Lines are means over seeds, bands their 95 % intervals. A condition has a colour and a style of
    line of its own, so that lines upon each other are distinguished.
    """
    count = len(analysis.followed)
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(3.6 * COLUMNS, 1.2 + 2.1 * rows), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, measure in zip(panels.flat, analysis.followed, strict=False):
            _panel(axes, measure, analysis)
        for axes in panels.flat[count:]:
            axes.set_visible(False)
        for axes in panels.flat[count - columns : count]:
            axes.set_xlabel("episode")
            axes.tick_params(labelbottom=True)
        _legend(figure, panels[0][0], analysis)
        return figure


def _panel(axes: Axes, measure: Measure, analysis: LearningCurves) -> None:
    for index, curves in enumerate(analysis.curves.values()):
        if measure.name in curves:
            _curve(axes, curves[measure.name], index)
    axes.set_title(measure.heading, loc="left")
    if measure.is_rate:
        axes.set_ylim(-0.03, 1.03)
    else:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    ticks = MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10])
    axes.xaxis.set_major_locator(ticks)
    axes.grid(axis="y", alpha=0.25)


def _curve(axes: Axes, estimate: Estimate, index: int) -> None:
    episodes = range(len(estimate.value))  # counted from 0, as in rows and specs
    colour = COLOURS[index % len(COLOURS)]
    style = STYLES[index % len(STYLES)]
    marker = "o" if len(estimate.value) == 1 else None
    axes.fill_between(episodes, estimate.low, estimate.high, color=colour, alpha=0.12, lw=0)
    axes.plot(episodes, estimate.value, color=colour, ls=style, lw=1.6, marker=marker)


def _legend(figure: Figure, axes: Axes, analysis: LearningCurves) -> None:
    seeds = {summary.condition: summary.seeds for summary in analysis.table}
    longest = max(len(condition) for condition in seeds)
    same = len(set(seeds.values())) == 1
    labels = [c if same else f"{c} ({n} seeds)" for c, n in seeds.items()]
    note = f"mean over {next(iter(seeds.values()))} seeds" if same else "mean over seeds"
    figure.legend(
        axes.get_lines(),
        labels,
        title=f"{note}, band: 95 % interval",
        loc="outside upper center",
        ncols=max(1, min(len(labels), 90 // (longest + 8))),
        frameon=False,
    )
