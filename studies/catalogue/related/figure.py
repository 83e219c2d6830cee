"""The figure of the related study: what systems achieve, and what they ask for."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import SymmetricalLogLocator

from ...presentation.figures import COLOURS, SETTINGS
from ...results.summary import EVALUATED
from .analysis import Related

PANELS = {
    EVALUATED: "success",
    "ms": "time of a decision [ms]",
    "memory [kB]": "memory [kB]",
    "counted": "operations of a decision",
}
"""Titles of panels by title of estimate."""
LEAST = {"ms": 0.01, "memory [kB]": 0.01, "counted": 1.0}
"""Where logarithmic axes begin; below, they are linear and hold 0."""
MOST_TICKS = 5
APART = 0.2
"""How far the points of one system stand apart, in rows."""


def figure_of(analysis: Related) -> Figure:
    """Return the figure: the systems one below the other, a colour for each world.

    Bars are 95 % intervals. Hollow marks are operations by formula, where they differ from those
    counted.
    """
    cases = analysis.cases
    systems = list(dict.fromkeys(case.system for case in cases))
    worlds = list(dict.fromkeys(case.world for case in cases))
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        height = 1.1 + 0.26 * len(systems)
        figure = Figure(figsize=(2.2 + 2.0 * len(PANELS), height), layout="constrained")
        panels = figure.subplots(1, len(PANELS), sharey=True, squeeze=False)[0]
        for axes, (name, title) in zip(panels, PANELS.items(), strict=True):
            for case in cases:
                which = worlds.index(case.world)
                colour = COLOURS[which % len(COLOURS)]
                y = systems.index(case.system) + APART * (which - (len(worlds) - 1) / 2)
                found = case.values[name]
                axes.plot([float(found.low), float(found.high)], [y, y], color=colour)
                if name == "counted" and case.values["formula"].value > 0:
                    axes.plot(
                        float(case.values["formula"].value), y, "o", color=colour,
                        markerfacecolor="white", markersize=4,
                    )  # fmt: skip
                axes.plot(float(found.value), y, "o", color=colour, markersize=3)
            axes.set_title(title, loc="left")
            axes.grid(axis="x", alpha=0.25)
            if name in LEAST:
                axes.set_xscale("symlog", linthresh=LEAST[name])
                axes.set_xlim(left=0.0)
                locator = SymmetricalLogLocator(base=10.0, linthresh=LEAST[name])
                locator.set_params(numticks=MOST_TICKS)
                axes.xaxis.set_major_locator(locator)
        panels[0].set_xlim(-0.03, 1.03)
        panels[0].set_yticks(np.arange(len(systems)), systems)
        panels[0].set_ylim(len(systems) - 0.5, -0.5)
        handles = [
            Line2D([], [], color=COLOURS[i % len(COLOURS)], marker="o", label=world or "all")
            for i, world in enumerate(worlds)
        ]
        handles.append(
            Line2D([], [], color="black", marker="o", markerfacecolor="white", linewidth=0,
                   label="by formula")
        )  # fmt: skip
        figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False)
        return figure
