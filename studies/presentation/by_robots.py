"""Lines over the number of robots: points with their intervals, a little beside each other."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ..results.statistics import Estimate, stacked
from .figures import add_legend, handle, look, marker

CHARACTERS = 15
"""Of a legend that have room in an inch."""
APART = 0.06
"""How far neighbouring lines stand apart, in doublings of the number of robots."""


def style(index: int) -> dict[str, Any]:
    """Return how a line looks: lines differ in colour, marker and dashes."""
    return look(index) | {"marker": marker(index), "markersize": 4, "linewidth": 1.2}


def draw_line(
    axes: Axes, robots: Sequence[int], estimates: Sequence[Estimate], index: int, lines: int
) -> None:
    """Draw estimates with their intervals: line `index` of so many lines, beside the others."""
    beside = 2.0 ** (APART * (index - (lines - 1) / 2))
    places = [beside * n for n in robots]
    all_of_them = stacked(estimates)
    axes.vlines(places, all_of_them.low, all_of_them.high, color=look(index)["color"], lw=1.2)
    axes.plot(places, all_of_them.value, **style(index))


def scale_axis(axes: Axes, robots: Sequence[int]) -> None:
    """Let the horizontal axis be the logarithm of the number of robots."""
    axes.set_xscale("log", base=2)
    axes.set_xticks(robots, [str(n) for n in robots])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.grid(alpha=0.25)


def name_lines(figure: Figure, labels: Sequence[str], title: str) -> None:
    """Name the lines above the panels, as many beside each other as there is room for."""
    handles = [handle(label, **style(i)) for i, label in enumerate(labels)]
    room = int(CHARACTERS * figure.get_figwidth() // (max(map(len, labels)) + 6))
    add_legend(figure, handles, title, ncols=max(1, min(4, room)))
