"""The figure of the single-agent study: learning curves, and the time of a step."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...presentation.figures import COLOURS, MARKERS, SETTINGS, STYLES, log_axis
from .analysis import Contests, smoothed

SMOOTHED = 10
"""Episodes that a point of a curve averages over."""


def figure_of(analysis: Contests) -> Figure:
    """Return the figure: a panel of curves for every number of agents, and one of times.

    Curves are means over seeds and `SMOOTHED` episodes.
    """
    agents = sorted({c.agents for c in analysis.contests})
    contenders = list(dict.fromkeys(c.contender for c in analysis.contests))
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        columns = len(agents) + 1
        figure = Figure(figsize=(2.4 * columns + 0.6, 3.2), layout="constrained")
        panels = figure.subplots(1, columns, squeeze=False)[0]
        for axes, n in zip(panels, agents, strict=False):
            for c in (c for c in analysis.contests if c.agents == n):
                width = min(SMOOTHED, len(c.curve.value))
                curve = smoothed(c.curve, width)
                look = _look(contenders.index(c.contender))
                axes.plot(np.arange(len(curve)) + width - 1, curve, **look)
            axes.set_ylim(-0.03, 1.03)
            axes.set_title(f"success, n = {n}", loc="left")
            axes.set_xlabel("episode")
        times = panels[-1]
        for i, contender in enumerate(contenders):
            own = [c for c in analysis.contests if c.contender == contender]
            values = [float(c.milliseconds.value) for c in own]
            times.plot(
                [c.agents for c in own], values, marker=MARKERS[i % len(MARKERS)], **_look(i)
            )
        log_axis(times)
        times.set_xticks(agents)
        times.set_xlabel("agents n")
        times.set_title("time of a step [ms]", loc="left")
        for axes in panels:
            axes.grid(alpha=0.25)
        handles = [
            Line2D([], [], marker=MARKERS[i % len(MARKERS)], label=contender, **_look(i))
            for i, contender in enumerate(contenders)
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
        return figure


def _look(index: int) -> dict[str, Any]:
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": STYLES[index % len(STYLES)]}
