"""Lines over the number of robots: points with their intervals, a little beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from ..results.statistics import Estimate
from .figures import COLOURS, MARKERS, STYLES

APART = 0.06
"""How far neighbouring lines stand apart, in doublings of the number of robots."""


def style(index: int) -> dict[str, Any]:
    """Return how a line looks: lines differ in colour, marker and dashes."""
    return {
        "color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)],
        "linestyle": STYLES[index % len(STYLES)],
        "markersize": 4, "linewidth": 1.2,
    }  # fmt: skip


def draw_line(
    axes: Axes, robots: Sequence[int], estimates: Sequence[Estimate], index: int, lines: int
) -> None:
    """Draw estimates with their intervals: line `index` of so many lines, beside the others."""
    beside = 2.0 ** (APART * (index - (lines - 1) / 2))
    places = [beside * n for n in robots]
    value, low, high = np.array(
        [[float(getattr(e, end)) for e in estimates] for end in ("value", "low", "high")]
    )
    look = style(index)
    axes.vlines(places, low, high, color=look["color"], linewidth=1.2)
    axes.plot(places, value, **look)


def scale_axis(axes: Axes, robots: Sequence[int]) -> None:
    """Let the horizontal axis be the logarithm of the number of robots."""
    axes.set_xscale("log", base=2)
    axes.set_xticks(robots, [str(n) for n in robots])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.grid(alpha=0.25)


def add_legend(figure: Figure, labels: Sequence[str], title: str) -> None:
    """Name the lines above the panels."""
    handles = [Line2D([], [], label=label, **style(i)) for i, label in enumerate(labels)]
    figure.legend(handles=handles, title=title, loc="outside upper center", ncols=4, frameon=False)
