"""Forest plots: values with their intervals, one line each, against a line of no difference."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..results.comparison import Difference
from ..results.paired_tests import LEVEL
from . import figures
from .figures import COLOURS, add_legend, draw_row, handle, name_rows


def draw(panels: Mapping[str, Sequence[Difference]], unit: str, null: float = 0.0) -> Figure | None:
    """Return a figure of panels side by side, sorted by the last one; None if there are none.

    Points are means over seeds, bars their 95 % intervals. Full points differ significantly from
    the null (p < .05, adjusted), hollow ones do not.

    Parameters
    ----------
    panels
        By title the lines of a panel, one per condition; all panels hold the same conditions.
    unit
        Label of the axis.
    null
        Where the line of no difference stands.
    """
    panels = {title: lines for title, lines in panels.items() if lines}
    if not panels:
        return None
    *_, last = panels.values()
    ranked = sorted(last, key=lambda line: float(line.estimate.value))
    names = [line.condition for line in ranked]
    width = 1.2 + 0.065 * max(map(len, names)) + 2.6 * len(panels)
    # No narrower than the legend.
    size = (max(width, 6.6), 1.5 + 0.25 * len(names))
    figure, all_axes = figures.panels(1, len(panels), size, sharey=True)
    for axes, (title, lines) in zip(all_axes[0], panels.items(), strict=True):
        _panel(axes, lines, names, null)
        axes.set_title(title, loc="left")
        axes.set_xlabel(unit)
    name_rows(all_axes[0, 0], names)
    _legend(figure, [line for lines in panels.values() for line in lines])
    return figure


def _panel(axes: Axes, lines: Sequence[Difference], names: Sequence[str], null: float) -> None:
    axes.axvline(null, color="#888888", linewidth=0.8)
    for line in lines:
        colour = COLOURS[0] if line.estimate.value >= null else COLOURS[1]
        face = colour if line.p < LEVEL else "white"
        row = names.index(line.condition)
        draw_row(axes, row, line.estimate, colour, markerfacecolor=face, markersize=5)
    axes.grid(axis="x", alpha=0.25)


def _legend(figure: Figure, lines: Sequence[Difference]) -> None:
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
    seeds = sorted({line.seeds for line in lines})
    counted = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
    add_legend(figure, handles, f"means over {counted} seeds, bars: 95 % intervals", ncols=2)
