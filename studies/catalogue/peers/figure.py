"""The figure of the peers study: success against experience, and against time."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from ...presentation.figures import COLOURS, SETTINGS, STYLES, log_axis
from .analysis import Peers


def figure_of(analysis: Peers) -> Figure:
    """Return the figure: evaluation success with its 95 % interval, a line per condition."""
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 3.4), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for i, course in enumerate(analysis.courses):
            value, low, high = (
                np.array([float(getattr(e, part)) for e in course.success])
                for part in ("value", "low", "high")
            )
            colour, style = COLOURS[i % len(COLOURS)], STYLES[i % len(STYLES)]
            for axes, spent in zip(panels, (course.decisions, course.seconds), strict=True):
                axes.fill_between(spent, low, high, color=colour, alpha=0.08, lw=0)
                label = course.condition if axes is panels[0] else None
                axes.plot(
                    spent, value, "o", color=colour, ls=style, lw=1.6, markersize=3.5, label=label
                )
        for axes, title in zip(panels, ("decisions", "CPU time of training [s]"), strict=True):
            log_axis(axes, "x")
            axes.set_xlabel(title)
            axes.set_ylim(-0.03, 1.03)
            axes.grid(axis="y", alpha=0.25)
        panels[0].set_ylabel("evaluation success")
        figure.legend(loc="outside upper center", ncols=4, frameon=False)
        return figure
