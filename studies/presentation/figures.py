"""Style of all figures, and writing of figures to files."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator
from numpy.typing import ArrayLike

from ...core.fonts import cover_text
from ...core.numerics import FloatArray
from ..results.aggregates import profiles
from ..results.analysis import Figures
from ..results.comparison import ComparisonTable
from ..results.differences import Difference
from ..results.permutation_tests import LEVEL
from ..results.statistics import Estimate, stack_estimates
from ..store.durable import replacing

SUFFIXES = (".svg", ".png", ".pdf")
"""Formats that figures are written in."""
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colors distinct to color-blind readers (Okabe and Ito 2008), without the palest."""
STYLES = (
    "-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1.5, 1, 1.5, 1, 1.5)),
    (0, (1, 3.5)), (0, (8, 3)),
)  # fmt: skip
"""Line styles, one for each color, because most colors are the same gray on paper."""
MARKERS = "osD^vPX"
"""Markers of points, one for each color."""
MAX_STEM = 100
"""Maximum number of characters of the name of a file, without numbers and the suffix."""
CHARACTERS = 15
"""Characters of a legend that fit into an inch."""
HANDLE = 6
"""Characters that would fit into the place of a legend's line or marker."""
LEGEND_ROWS = 4
"""Lines of a legend for which every figure has room."""
ROW_HEIGHT = 0.2
"""Height of a line of a legend [inch]."""
IN_ROW = 0.2
"""Distance between the points of one row of a chart [rows]."""
SETTINGS: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "svg.hashsalt": "nested-agents",
    "svg.fonttype": "none",
}


@contextmanager
def apply_style() -> Iterator[None]:
    """Apply the style of all figures to those made within the context."""
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        yield


def spell_dollars(figure: Figure, names: Iterable[str]) -> Figure:
    """Print ``$`` as a character if any name contains it, instead of starting a formula."""
    if any("$" in name for name in names):
        for text in figure.findobj(Text):
            if isinstance(text, Text) and "$" in text.get_text():  # ticks of logarithms come later
                text.set_parse_math(False)
    return figure


def panels(
    rows: int, columns: int, size: tuple[float, float], **sharing: Any
) -> tuple[Figure, Any]:
    """Return a figure of a size [inches] and its axes ``(rows, columns)``."""
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **sharing)


def grid(
    count: int,
    most: int,
    each: tuple[float, float],
    margin: tuple[float, float],
    least: float = 0.0,
    **sharing: Any,
) -> tuple[Figure, Any]:
    """Return a figure with a number of panels, at most `most` in a row, see `panels`.

    Width and height [inch] are those of `each` panel and the `margin` of all of them; the width is
    the `least` at least.
    """
    columns = min(most, count)
    rows = -(-count // columns)
    size = max(least, margin[0] + each[0] * columns), margin[1] + each[1] * rows
    figure, axes = panels(rows, columns, size, **sharing)
    for spare in axes.flat[count:]:
        spare.set_visible(False)
    return figure, axes


def look(index: int) -> dict[str, Any]:
    """Return color and dashes of a line."""
    cycle = index // len(COLORS)  # a color that comes again has other dashes
    return {"color": COLORS[index % len(COLORS)], "ls": STYLES[(index + cycle) % len(STYLES)]}


def marker(index: int) -> str:
    """Return the marker that belongs to a `look`."""
    return MARKERS[(index + index // len(COLORS)) % len(MARKERS)]


def draw_curve(
    axes: Axes, x: ArrayLike, estimate: Estimate, index: int, *, alpha: float = 0.12, **kwargs: Any
) -> None:
    """Draw estimates ``(n,)`` over `x` as a line with a band of intervals.

    The edges of the band have the dashes of the line, which tell bands apart where they overlap.
    A single estimate is a marker with a bar, above the lines of others.
    """
    places = np.asarray(x)
    style = look(index)
    if len(places) == 1:
        kwargs = {"marker": "o", "zorder": 3, **kwargs}
        axes.vlines(places, estimate.low, estimate.high, color=style["color"], lw=1.0)
    axes.fill_between(places, estimate.low, estimate.high, color=style["color"], alpha=alpha, lw=0)
    for edge in (estimate.low, estimate.high):
        axes.plot(places, edge, **style, lw=0.6, alpha=0.7)
    axes.plot(places, estimate.value, **style, lw=1.6, **kwargs)


def draw_row(
    axes: Axes, row: float, estimate: Estimate, *, color: str, marker: str = "o", **kwargs: Any
) -> None:
    """Draw an estimate as a point with its interval, on a row of a chart."""
    value, *ends = map(float, estimate)
    if np.isfinite(ends).all():
        axes.plot(ends, [row, row], color=color)
    axes.plot(value, row, marker, color=color, **kwargs)


def beside(count: int) -> list[float]:
    """Return the offsets of the points of one row from its middle [rows].

    >>> beside(3)
    [-0.2, 0.0, 0.2]
    """
    return [IN_ROW * (index - (count - 1) / 2) for index in range(count)]


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows of a chart, the first one on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def as_rates(axes: Axes, which: Literal["x", "y"] = "y") -> None:
    """Set the limits of an axis of rates."""
    axes.set(**{f"{which}lim": (-0.03, 1.03)})


def as_episodes(axes: Axes) -> None:
    """Label the horizontal axis as episodes, with whole numbers."""
    axes.set_xlabel("episode")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10]))
    axes.tick_params(labelbottom=True)


def handle(label: str, **kwargs: Any) -> Line2D:
    """Return an entry of a legend."""
    return Line2D([], [], label=label, **kwargs)


def add_legend(
    figure: Figure, handles: Sequence[Artist], title: str = "", max_columns: int = 4
) -> None:
    """Add a legend above the panels, with as many columns as fit; long labels are wrapped.

    The figure grows with a legend of more than `LEGEND_ROWS` lines, so that its panels do not
    shrink.
    """
    room = int(CHARACTERS * figure.get_figwidth())
    for entry in handles:
        entry.set_label(fill(str(entry.get_label()), room - 3 * HANDLE))
    lines = [str(entry.get_label()).splitlines() for entry in handles]
    longest = max(len(line) for label in lines for line in label)
    columns = max(1, min(max_columns, room // (longest + HANDLE)))
    rows = sum(map(len, lines)) / columns
    figure.set_figheight(figure.get_figheight() + max(0.0, rows - LEGEND_ROWS) * ROW_HEIGHT)
    figure.legend(
        handles=handles, title=title or None, loc="outside upper center", ncols=columns,
        frameon=False, handlelength=3,
    )  # fmt: skip


def name_curves(figure: Figure, labels: Sequence[str], title: str = "", **look_of: object) -> None:
    """Add a legend of curves above the panels."""
    handles = [handle(label, **look(i), lw=1.6, **look_of) for i, label in enumerate(labels)]
    add_legend(figure, handles, title)


def save(
    figures: Mapping[str, Figure], folder: Path, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write figures into an existing folder, by their names; return the paths.

    `formats` are suffixes without a dot.
    """
    paths = []
    for stem, figure in zip(file_stems(figures), figures.values(), strict=True):
        for suffix in formats:
            paths.append(folder / f"{stem}.{suffix}")
            write(figure, paths[-1])
    return paths


def file_stems(names: Iterable[str]) -> list[str]:
    """Return distinct names of files, without suffixes, spaces, commas and slashes.

    >>> file_stems(["transient, topology=chain", "a/b", "a b"])
    ['transient-topology=chain', 'a-b', 'a-b-2']
    """
    stems: list[str] = []
    for name in names:
        stem = re.sub(r"[^\w.=+-]+", "-", name)[:MAX_STEM].strip("-.") or "figure"
        while stem in stems:
            stem = f"{stem}-2"
        stems.append(stem)
    return stems


def write(figure: Figure, path: Path) -> None:
    """Write a figure atomically as SVG, PNG or PDF, by the suffix of the path.

    Equal figures give equal files, because they hold no date.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    """
    check_suffix(path)
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix)
    cover_text(figure)
    with apply_style(), replacing(path) as file:
        figure.savefig(file, format=path.suffix[1:], dpi=150, metadata=metadata)


def log_axis(axes: Axes, which: Literal["x", "y"] = "y") -> None:
    """Make an axis logarithmic with plain numbers as ticks: 0.5, 1, 2, 5.

    It stays linear where nothing is above zero.
    """
    extent = axes.dataLim.intervaly if which == "y" else axes.dataLim.intervalx
    if not extent[1] > 0.0:
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.yaxis if which == "y" else axes.xaxis
    low, high = axis.get_view_interval()
    decades = np.log10(high / low)
    few = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if decades < 1.0 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=few if decades < 3.0 else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    axis.set_minor_formatter(NullFormatter())


def check_suffix(path: Path) -> None:
    """Raise `ValueError` if `write` does not support the suffix of a path."""
    if path.suffix not in SUFFIXES:
        raise ValueError(f"{path}: suffix must be .svg, .png or .pdf")


APART = 0.06
"""Distance between neighboring lines, in doublings of the horizontal axis."""


def style(index: int) -> dict[str, Any]:
    """Return color, marker and dashes of a line."""
    return look(index) | {"marker": marker(index), "markersize": 4, "linewidth": 1.2}


def beside_each_other(sizes: ArrayLike, index: int, lines: int) -> FloatArray:
    """Return sizes, shifted a little for line `index` of several lines."""
    shift: float = 2.0 ** (APART * (index - (lines - 1) / 2))
    return shift * np.asarray(sizes, dtype=float)


def draw_line(
    axes: Axes, sizes: Sequence[int], estimates: Sequence[Estimate], index: int, lines: int
) -> None:
    """Draw line `index` of several lines with intervals, shifted a little from the others."""
    places = beside_each_other(sizes, index, lines)
    all_of_them = stack_estimates(estimates)
    axes.vlines(places, all_of_them.low, all_of_them.high, color=look(index)["color"], lw=1.2)
    axes.plot(places, all_of_them.value, **style(index))


def scale_axis(axes: Axes, sizes: Sequence[int]) -> None:
    """Make the horizontal axis the logarithm of the team size."""
    axes.set_xscale("log", base=2)
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.grid(alpha=0.25)


def name_lines(
    figure: Figure, labels: Sequence[str], title: str, others: Sequence[Line2D] = ()
) -> None:
    """Add a legend of lines, and other entries, above the panels."""
    handles = [*(handle(label, **style(i)) for i, label in enumerate(labels)), *others]
    add_legend(figure, handles, title)


def draw_forest(
    name: str, compared: Mapping[str, Sequence[Difference]], unit: str, null: float = 0.0
) -> Figures:
    """Return by its name a figure of panels side by side, sorted by the last; or no figure.

    Points are means over seeds, bars their 95% intervals. Full points differ significantly from
    the null (p < 0.05, adjusted), hollow ones do not.

    Parameters
    ----------
    name
        That of the figure.
    compared
        By title the lines of a panel, one per condition; all panels hold the same conditions.
    unit
        Label of the axis.
    null
        Where the line of no difference stands.
    """
    compared = {title: lines for title, lines in compared.items() if lines}
    if not compared:
        return {}
    *_, last = compared.values()
    ranked = sorted(last, key=lambda line: float(line.estimate.value))
    names = [line.condition for line in ranked]
    width = 1.2 + 0.065 * max(map(len, names)) + 2.6 * len(compared)
    # No narrower than the legend.
    size = (max(width, 6.6), 1.5 + 0.25 * len(names))
    figure, all_axes = panels(1, len(compared), size, sharey=True)
    for axes, (title, lines) in zip(all_axes[0], compared.items(), strict=True):
        axes.axvline(null, color="#888888", linewidth=0.8)
        for line in lines:
            color = COLORS[0] if line.estimate.value >= null else COLORS[1]
            face = color if line.p < LEVEL else "white"
            row = names.index(line.condition)
            draw_row(axes, row, line.estimate, color=color, markerfacecolor=face, markersize=5)
        axes.grid(axis="x", alpha=0.25)
        axes.set_title(title, loc="left")
        axes.set_xlabel(unit)
    name_rows(all_axes[0, 0], names)
    _forest_legend(figure, [line for lines in compared.values() for line in lines])
    return {name: figure}


def _forest_legend(figure: Figure, lines: Sequence[Difference]) -> None:
    point = {"marker": "o", "ls": "", "color": "#444444"}
    handles = [
        handle("significantly different (adjusted p < 0.05)", **point),
        handle("no significant difference", **point, markerfacecolor="white"),
        handle("higher than the reference", color=COLORS[0], linewidth=1.5),
        handle("lower than the reference", color=COLORS[1], linewidth=1.5),
    ]
    seeds = count_seeds(line.seeds for line in lines)
    add_legend(figure, handles, f"means over {seeds} seeds, bars: 95% intervals", max_columns=2)


def count_seeds(counts: Iterable[int]) -> str:
    """Return the number of seeds, or its range if conditions differ.

    >>> count_seeds([20, 20]), count_seeds([20, 18, 20])
    ('20', '18 to 20')
    """
    low, *others = sorted(set(counts))
    return f"{low} to {others[-1]}" if others else f"{low}"


def draw_profiles(compared: ComparisonTable) -> Figure:
    """Return the figure of performance profiles: the share of runs above each score."""
    thresholds, by_condition = profiles(compared)
    with apply_style():
        figure, axes = panels(1, 1, (4.5, 2.9))
        for index, profile in enumerate(by_condition.values()):
            draw_curve(axes[0, 0], thresholds, profile, index)
        axes[0, 0].set(xlabel=f"score: {compared.title}", title="share of runs that score more")
        as_rates(axes[0, 0])
        name_curves(figure, [*by_condition])
    return spell_dollars(figure, by_condition)
