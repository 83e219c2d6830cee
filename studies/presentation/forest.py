"""Forest plots: values with their intervals, one line each, against a line of no difference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..results.comparison import Difference
from ..results.paired_tests import LEVEL
from .figures import COLOURS, SETTINGS


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
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        width = 1.2 + 0.065 * max(map(len, names)) + 2.6 * len(panels)
        figure = Figure(figsize=(width, 1.5 + 0.25 * len(names)), layout="constrained")
        all_axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axes, panel in zip(all_axes, panels, strict=True):
            _panel(axes, panel, names, unit)
        all_axes[0].set_yticks(range(len(names)), names)
        all_axes[0].set_ylim(len(names) - 0.4, -0.6)
        _legend(figure, panels)
        return figure


def _panel(axes: Axes, panel: Panel, names: Sequence[str], unit: str) -> None:
    axes.axvline(panel.null, color="#888888", linewidth=0.8)
    for line in panel.lines:
        row, estimate = names.index(line.condition), line.estimate
        significant = line.p < LEVEL
        colour = COLOURS[0] if estimate.value >= panel.null else COLOURS[1]
        if np.isfinite([estimate.low, estimate.high]).all():
            axes.plot([estimate.low, estimate.high], [row, row], color=colour, linewidth=1.5)
        face = colour if significant else "white"
        axes.plot(float(estimate.value), row, "o", color=colour, markerfacecolor=face, markersize=5)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel(unit)
    axes.grid(axis="x", alpha=0.25)


def _legend(figure: Figure, panels: Sequence[Panel]) -> None:
    handles = [
        Line2D([], [], marker="o", ls="", color="#444444", markerfacecolor=face, label=text)
        for face, text in (
            ("#444444", "significantly different (adjusted p < .05)"),
            ("white", "no significant difference"),
        )
    ]
    handles += [
        Line2D([], [], color=colour, linewidth=1.5, label=f"{word} than the reference")
        for colour, word in zip(COLOURS, ("higher", "lower"), strict=False)
    ]
    seeds = sorted({line.seeds for panel in panels for line in panel.lines})
    counted = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    title = f"means over {counted} seeds, bars: 95 % intervals"
    figure.legend(handles=handles, title=title, loc="outside upper center", ncols=2, frameon=False)
