"""The figure of cost: formula, counts and times against the number of agents, on log scales."""

from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from math import log10
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..presentation import figures
from ..presentation.figures import add_legend, handle, look, marker
from .cost import CostRow

TITLES = ("operations, by formula", "rule evaluations a step", "time of a step [s]")
"""Of the panels; the last two hold what was measured."""
Points = Sequence[tuple[int, float]]
"""Numbers of agents, each with the logarithm of a value."""


def draw(rows: Sequence[CostRow], path: Path) -> None:
    """Write the figure: SVG, PNG or PDF by the suffix of `path`.

    The first panel holds the formulas, their logarithms on a logarithmic scale. If anything was
    measured, the others hold rule evaluations per step (lines by formula, markers counted) and time
    per step (markers timed, lines the formula's growth through the last of them). Values are drawn
    by their logarithms, for no floating-point number holds those of many agents.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    """
    figures.check_suffix(path)
    series = {
        text: [row for row in rows if row.topology == text]
        for text in dict.fromkeys(row.topology for row in rows)
    }
    measured = any(row.measured is not None for row in rows)
    single = [(n, _log10(cost)) for n, cost in {r.agents: r.single_agent for r in rows}.items()]
    with figures.apply_style():
        columns = 3 if measured else 1
        figure, (all_axes,) = figures.panels(1, columns, (3.2 * columns + 0.6, 4.2))
        all_axes[0].plot(*zip(*single, strict=True), "--", color="black")
        for index, own in enumerate(series.values()):
            _draw_series(all_axes, own, index)
        for axes, title in zip(all_axes, TITLES, strict=False):
            axes.set_title(title, loc="left")
            axes.set_xlabel("agents n")
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter(FuncFormatter(lambda n, _: f"{n:g}"))
            if axes is all_axes[0]:
                axes.set_yscale("log")  # the single agent's exponents have four digits
            else:
                axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=7))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"$10^{{{y:g}}}$"))
            axes.grid(alpha=0.25)
        add_legend(figure, _handles(list(series), measured), ncols=columns + (columns > 1))
        figures.write(figure, path)


def _draw_series(all_axes: Sequence[Axes], rows: Sequence[CostRow], index: int) -> None:
    exact = [(r.agents, _log10(r.nested_exact)) for r in rows if r.nested_exact is not None]
    if exact:
        _draw_line(all_axes[0], exact, exact[-1:], index)
    costs = [(row.agents, row.measured) for row in rows if row.measured is not None]
    if not costs:
        return
    by_formula = {row.agents: row.formula.rule_evaluations for row in rows if row.formula}
    formula = [(n, _log10(by_formula[n])) for n, _ in costs]
    counted = [(n, _log10(m.counted.rule_evaluations)) for n, m in costs]
    timed = [(n, log10(m.deciding + m.learning)) for n, m in costs]
    grown = [(n, value - formula[-1][1] + timed[-1][1]) for n, value in formula]
    _draw_line(all_axes[1], formula, counted, index)
    _draw_line(all_axes[2], grown, timed, index)


def _draw_line(axes: Axes, line: Points, marked: Points, index: int) -> None:
    colour = look(index)["color"]
    size = _marker_size(index)
    axes.plot(*zip(*line, strict=True), **look(index), lw=1.2)
    axes.plot(
        *zip(*marked, strict=True),
        marker(index),
        color=colour,
        markerfacecolor="none",
        markersize=size,
    )


def _handles(topologies: Sequence[str], measured: bool) -> list[Line2D]:
    handles = [
        handle(
            text,
            marker=marker(i),
            **look(i),
            markerfacecolor="none",
            markersize=_marker_size(i),
        )
        for i, text in enumerate(topologies)
    ]
    handles.append(handle("single agent (Eq. 23)", ls="--", color="black"))
    if measured:
        handles.append(handle("lines: formula", color="grey"))
        handles.append(handle("markers: measured", ls="", marker="o", color="grey"))
    return handles


def _marker_size(index: int) -> float:
    """Return ever smaller sizes, so that hollow markers in one place can be distinguished."""
    return max(9.0 - 1.2 * index, 3.5)


def _log10(value: int | Fraction) -> float:
    return float(Decimal(round(value)).log10())
