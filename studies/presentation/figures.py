"""How every figure looks, and how figures are written to files."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import ArrayLike

from ..results.statistics import Estimate
from ..store.durable import replacing

SUFFIXES = (".svg", ".png", ".pdf")
"""Formats that figures are written in."""
USUAL = ("png", "svg")
"""Those that figures of a study are written in by default."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Distinct to colour-blind readers (Okabe and Ito 2008); the palest is left out."""
STYLES = (
    "-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1.5, 1, 1.5, 1, 1.5)),
    (0, (1, 3.5)), (0, (8, 3)),
)  # fmt: skip
"""As many as there are colours, most of which are one grey on paper."""
MARKERS = "osD^vPX"
"""The same for points."""
SETTINGS: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "svg.hashsalt": "nested-agents",
    "svg.fonttype": "none",
}


@contextmanager
def styled() -> Iterator[None]:
    """Let figures that are made within look as all do."""
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        yield


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
    """Return a figure of a number of panels, see `panels`, at most so many side by side.

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
    """Return colour and dashes of a line, by which lines differ."""
    cycle = index // len(COLOURS)  # a colour that comes again has other dashes
    return {"color": COLOURS[index % len(COLOURS)], "ls": STYLES[(index + cycle) % len(STYLES)]}


def marker(index: int) -> str:
    """Return the marker that goes with a `look`."""
    return MARKERS[index % len(MARKERS)]


def draw_curve(
    axes: Axes, x: ArrayLike, estimate: Estimate, index: int, *, alpha: float = 0.12, **kwargs: Any
) -> None:
    """Draw estimates ``(n,)`` over `x` as a line, with a band for their intervals."""
    axes.fill_between(
        np.asarray(x), estimate.low, estimate.high, color=look(index)["color"], alpha=alpha, lw=0
    )
    axes.plot(np.asarray(x), estimate.value, **look(index), lw=1.6, **kwargs)


def draw_row(
    axes: Axes, row: float, estimate: Estimate, colour: str, marker: str = "o", **kwargs: Any
) -> None:
    """Draw an estimate as a point with its interval, on a row of a chart."""
    if np.isfinite([estimate.low, estimate.high]).all():
        axes.plot([float(estimate.low), float(estimate.high)], [row, row], color=colour)
    axes.plot(float(estimate.value), row, marker, color=colour, **kwargs)


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows of a chart, the first one on top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def as_rates(axes: Axes, which: Literal["x", "y"] = "y") -> None:
    """Let an axis show rates, from 0 to 1."""
    axes.set(**{f"{which}lim": (-0.03, 1.03)})


def as_episodes(axes: Axes) -> None:
    """Let the horizontal axis count episodes."""
    axes.set_xlabel("episode")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10]))
    axes.tick_params(labelbottom=True)


def handle(label: str, **kwargs: Any) -> Line2D:
    """Return an entry of a legend."""
    return Line2D([], [], label=label, **kwargs)


def add_legend(figure: Figure, handles: Sequence[Line2D], title: str = "", ncols: int = 4) -> None:
    """Name what is drawn, above the panels."""
    figure.legend(
        handles=handles, title=title or None, loc="outside upper center", ncols=ncols,
        frameon=False, handlelength=3,
    )  # fmt: skip


def save(figures: Mapping[str, Figure], folder: Path, formats: Sequence[str] = USUAL) -> list[Path]:
    """Write figures into an existing folder, by their names; return the paths.

    `formats` are suffixes without a dot.
    """
    paths = [folder / f"{name}.{suffix}" for name in figures for suffix in formats]
    for path in paths:
        write(figures[path.stem], path)
    return paths


def write(figure: Figure, path: Path) -> None:
    """Write a figure: SVG, PNG or PDF by suffix; it is there whole or not at all.

    Equal figures give equal files: no date in them.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    """
    check_suffix(path)
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix)
    with styled(), replacing(path) as file:
        figure.savefig(file, format=path.suffix[1:], dpi=150, metadata=metadata)


def log_axis(axes: Axes, which: Literal["x", "y"] = "y") -> None:
    """Let an axis be logarithmic, its ticks plain numbers: 0.5, 1, 2, 5."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.yaxis if which == "y" else axes.xaxis
    low, high = axis.get_view_interval()
    few = np.log10(high / low) < 3.0
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    axis.set_minor_formatter(NullFormatter())


def check_suffix(path: Path) -> None:
    """Refuse a path that `write` does not take, before anything is computed for it."""
    if path.suffix not in SUFFIXES:
        raise ValueError(f"{path}: suffix must be .svg, .png or .pdf")
