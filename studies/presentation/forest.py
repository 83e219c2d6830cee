"""Forest plots: values with their intervals, one line each, against a line of no difference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..results.comparison import Difference
from ..results.paired_tests import LEVEL
from . import figures
from .figures import COLOURS, add_legend, draw_row, handle, name_rows


@dataclass(frozen=True)
class Panel:
    """Lines that share an axis.

    Attributes
    ----------
    title
        What is shown.
    lines
        One per condition; all panels of a figure hold the same conditions.
    null
        Where the line of no difference stands.
    """

    title: str
    lines: Sequence[Difference]
    null: float = 0.0


def draw(panels: Sequence[Panel], unit: str) -> Figure | None:
    """Return a figure of panels side by side, sorted by the last one; None if there are none.

    Points are means over seeds, bars their 95 % intervals. Full points differ significantly from
    the null (p < .05, adjusted), hollow ones do not.
    """
    panels = [panel for panel in panels if panel.lines]
    if not panels:
        return None
    ranked = sorted(panels[-1].lines, key=lambda line: float(line.estimate.value))
    names = [line.condition for line in ranked]
    size = (1.2 + 0.065 * max(map(len, names)) + 2.6 * len(panels), 1.5 + 0.25 * len(names))
    figure, all_axes = figures.panels(1, len(panels), size, sharey=True)
    for axes, panel in zip(all_axes[0], panels, strict=True):
        _panel(axes, panel, names, unit)
    name_rows(all_axes[0, 0], names)
    _legend(figure, panels)
    return figure


def _panel(axes: Axes, panel: Panel, names: Sequence[str], unit: str) -> None:
    axes.axvline(panel.null, color="#888888", linewidth=0.8)
    for line in panel.lines:
        colour = COLOURS[0] if line.estimate.value >= panel.null else COLOURS[1]
        face = colour if line.p < LEVEL else "white"
        row = names.index(line.condition)
        draw_row(axes, row, line.estimate, colour, markerfacecolor=face, markersize=5)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel(unit)
    axes.grid(axis="x", alpha=0.25)


def _legend(figure: Figure, panels: Sequence[Panel]) -> None:
    filled = {
        "significantly different (adjusted p < .05)": "#444444",
        "no significant difference": "white",
    }
    handles = [
        handle(text, marker="o", ls="", color="#444444", markerfacecolor=face)
        for text, face in filled.items()
    ]
    handles += [
        handle(f"{word} than the reference", color=colour, linewidth=1.5)
        for colour, word in zip(COLOURS, ("higher", "lower"), strict=False)
    ]
    seeds = sorted({line.seeds for panel in panels for line in panel.lines})
    counted = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    add_legend(figure, handles, f"means over {counted} seeds, bars: 95 % intervals", ncols=2)
