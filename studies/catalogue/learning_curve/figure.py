"""Figures of a learning curve: distance, orientation, contact and success by episode."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...analysis.statistics import Estimate
from ...presentation.figures import COLOURS, SETTINGS, STYLES
from .analysis import LearningCurves

PANELS = (
    ("success", "success rate", (-0.03, 1.03)),
    ("final_distance_m", "final distance to goal [m]", None),
    ("final_orientation_rad", "final orientation error [rad]", None),
    ("contact_fraction", "time in contact, per robot", None),
)


def figure_of(analysis: LearningCurves) -> Figure:
    """Return the figure.

    Lines are means over seeds, bands their 95 % intervals. A condition has a colour and a style of
    line of its own, so that lines upon each other are told apart.
    """
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        panels = figure.subplots(2, 2, sharex=True)
        for axes, (measure, title, limits) in zip(panels.flat, PANELS, strict=True):
            for index, curves in enumerate(analysis.curves.values()):
                _curve(axes, curves[measure], index)
            axes.set_title(title, loc="left")
            if limits is not None:
                axes.set_ylim(*limits)
            else:
                axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            ticks = MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10])
            axes.xaxis.set_major_locator(ticks)
            axes.grid(axis="y", alpha=0.25)
        for axes in panels[-1]:
            axes.set_xlabel("episode")
        _legend(figure, panels[0][0], analysis)
        return figure


def _curve(axes: Axes, estimate: Estimate, index: int) -> None:
    episodes = range(1, len(estimate.value) + 1)
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
