"""How every figure looks, and how figures are written to files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..store.durable import replacing

SUFFIXES = (".svg", ".png", ".pdf")
"""Formats that figures are written in."""
USUAL = ("png", "svg")
"""Those that figures of a study are written in unless said otherwise."""
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
    with mpl.rc_context(SETTINGS), replacing(path) as file:  # type: ignore[arg-type]
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
