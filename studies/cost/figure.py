"""The figure of cost: formula, counts and times against the number of agents, on log scales."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from math import log10
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..presentation.figures import COLOURS, MARKERS, SETTINGS, check_suffix, write
from .cost import CostRow


def draw(rows: Sequence[CostRow], path: Path) -> None:
    """Write the figure: SVG, PNG or PDF by the suffix of `path`.

    The first panel holds the formulas. If anything was measured, the others hold rule evaluations
    per step (lines by formula, markers counted) and time per step (markers timed, lines the
    formula's growth through the last of them). Values are drawn by their logarithms, for no
    floating-point number holds those of many agents.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    """
    check_suffix(path)
    series = {
        text: [row for row in rows if row.topology == text]
        for text in dict.fromkeys(row.topology for row in rows)
    }
    measured = any(row.measured is not None for row in rows)
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        columns = 3 if measured else 1
        figure = Figure(figsize=(3.2 * columns + 0.6, 3.7), layout="constrained")
        panels = figure.subplots(1, columns, squeeze=False)[0]
        _formulas(panels[0], series)
        if measured:
            _measured(panels[1], panels[2], series)
        for axes in panels:
            axes.set_xlabel("agents n")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
            axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=7))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"$10^{{{y:g}}}$"))
            axes.grid(alpha=0.25)
        handles = _legend(list(series), measured)
        longest = max(len(str(handle.get_label())) for handle in handles)
        # A letter is about 0.06 in wide, the sample of a line and its margins 0.5 in.
        columns = int(figure.get_figwidth() / (0.06 * longest + 0.5))
        figure.legend(handles=handles, loc="outside lower center", ncols=max(1, min(4, columns)))
        write(figure, path)


def _formulas(axes: Axes, series: dict[str, list[CostRow]]) -> None:
    single = {row.agents: row.single_agent for rows in series.values() for row in rows}
    axes.plot(list(single), [_log10(v) for v in single.values()], "--", color="black")
    for index, rows in enumerate(series.values()):
        points = [(r.agents, _log10(r.nested_exact)) for r in rows if r.nested_exact is not None]
        if points:
            axes.plot(*zip(*points, strict=True), **_line(index))
            axes.plot(*points[-1], MARKERS[index % len(MARKERS)], **_marker(index))
    axes.set_title("operations, by formula", loc="left")


def _measured(counts: Axes, times: Axes, series: dict[str, list[CostRow]]) -> None:
    for index, rows in enumerate(series.values()):
        points = [(r.agents, r.measured) for r in rows if r.measured is not None]
        if not points:
            continue
        n = [agents for agents, _ in points]
        formula = [_log10(m.formula.rule_evaluations) for _, m in points]
        counted = [_log10(m.counted.rule_evaluations) for _, m in points]
        timed = [log10(m.deciding + m.learning) for _, m in points]
        grown = [value - formula[-1] + timed[-1] for value in formula]
        for axes, line, marked in ((counts, formula, counted), (times, grown, timed)):
            axes.plot(n, line, **_line(index))
            axes.plot(n, marked, MARKERS[index % len(MARKERS)], **_marker(index))
    counts.set_title("rule evaluations a step", loc="left")
    times.set_title("time of a step [s]", loc="left")


def _legend(topologies: Sequence[str], measured: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], marker=MARKERS[i % len(MARKERS)], label=text, **_line(i), **_hollow(i))
        for i, text in enumerate(topologies)
    ]
    handles.append(Line2D([], [], linestyle="--", color="black", label="single agent (Eq. 23)"))
    if measured:
        handles.append(Line2D([], [], color="grey", label="lines: formula"))
        handles.append(
            Line2D([], [], linestyle="", marker="o", color="grey", label="markers: measured")
        )
    return handles


def _line(index: int) -> dict[str, Any]:
    return {"color": COLOURS[index % len(COLOURS)], "linewidth": 1.2}


def _marker(index: int) -> dict[str, Any]:
    return {"color": COLOURS[index % len(COLOURS)], **_hollow(index)}


def _hollow(index: int) -> dict[str, Any]:
    """Hollow and ever smaller, so that markers in one place can be distinguished."""
    return {"markerfacecolor": "none", "markersize": max(9.0 - 1.2 * index, 3.5)}


def _log10(value: int | Fraction) -> float:
    return float(Decimal(round(value)).log10())
