"""Figure of cost: formula, counts and times against the number of agents."""

from collections.abc import Mapping, Sequence
from decimal import Decimal
from itertools import pairwise
from math import log10
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from ...core.agents.cost import Problem
from ..presentation import figures
from .cost import ACTIONS, RULES, CostRow

MAX_SERIES = 5
"""Lines of a panel that can be told apart, the single agent included."""
MAX_PANELS = 12
SINGLE_AGENT = "single agent (Eq. 23)"
LOOKS = [
    {**figures.look(i), "marker": figures.marker(i), "markersize": size, "lw": 1.2}
    for i, size in enumerate((8.0, 6.5, 5.0, 3.5))
]
"""Looks of hierarchies; hollow markers of decreasing size can be told apart in one place."""
SINGLE_LOOK = {"color": "black", "ls": "--", "marker": "x", "markersize": 6.0, "lw": 1.2}
Points = Sequence[tuple[int, float]]
"""Numbers of agents, each with the logarithm of a value."""
Looks = Mapping[str, Mapping[str, Any]]
"""Looks of lines by their labels."""


def check(rows: Sequence[CostRow], path: Path) -> tuple[list[Problem], list[str]]:
    """Return the problems and the topologies of a figure that can be read.

    Raises
    ------
    ValueError
        If the suffix of `path` is unknown, or there are too many series or panels; one line.
    """
    problems = list(dict.fromkeys(row.problem for row in rows))
    names = list(dict.fromkeys(row.topology for row in rows if row.nested_exact is not None))
    figures.check_suffix(path)
    if len(names) >= MAX_SERIES:
        raise ValueError(
            f"{path}: {len(names)} topologies and the single agent, allowed in a figure: "
            f"{MAX_SERIES} series; name fewer topologies"
        )
    if len(problems) > MAX_PANELS:
        raise ValueError(
            f"{path}: {len(problems)} pairs of rules and actions, allowed in a figure: "
            f"{MAX_PANELS}, one panel each"
        )
    return problems, names


def draw(rows: Sequence[CostRow], path: Path) -> None:
    """Write the figure: SVG, PNG or PDF by the suffix of `path`.

    Each pair of rules and actions has a panel of the formulas. If anything was measured, two more
    panels show rule evaluations per step (lines by formula, markers counted) and time per step
    (markers timed, lines the formula's growth through the last of them). All values are drawn by
    their logarithms, because those of many agents exceed every floating-point number.

    Raises
    ------
    ValueError
        See `check`.
    """
    problems, names = check(rows, path)
    looks: Looks = {**dict(zip(names, LOOKS, strict=False)), SINGLE_AGENT: SINGLE_LOOK}
    is_measured = any("decision_ms" in row.extra for row in rows)
    with figures.apply_style():
        count = len(problems) + 2 * is_measured
        columns = 2 if count == 4 else min(count, 3)
        figure, panels = figures.grid(count, columns, (3.1, 2.7), (0.5, 0.9), least=4.4)
        for axes, problem in zip(panels.flat, problems, strict=False):
            _draw_formulas(axes, [row for row in rows if row.problem == problem], looks)
        if is_measured:
            first = [row for row in rows if row.problem == problems[0]]
            _draw_measured(panels.flat[count - 2], panels.flat[count - 1], first, looks)
        sizes = sorted({row.agents for row in rows})
        for axes in panels.flat[:count]:
            _scale(axes, sizes)
        handles = [_handle(name, look) for name, look in looks.items()]
        if is_measured:
            handles.append(figures.handle("lines: formula", color="gray"))
            handles.append(figures.handle("markers: measured", ls="", marker="o", color="gray"))
        figures.add_legend(figure, handles, max_columns=1 + columns)
        figures.write(figures.spell_dollars(figure, names), path)


def _draw_formulas(axes: Axes, rows: Sequence[CostRow], looks: Looks) -> None:
    """Draw the operations of each hierarchy and of the single agent."""
    problem = rows[0].problem
    axes.set_title(f"by formula, |S| = {problem.rules:,}, |A| = {problem.actions:,}", loc="left")
    axes.set_ylabel("log10(operations)")
    for name, look in looks.items():
        values: dict[int, int | None]
        if name == SINGLE_AGENT:
            values = {row.agents: row.single_agent for row in rows}
        else:
            values = {r.agents: r.nested_exact for r in rows if r.topology == name}
        line = [(n, _log10(value)) for n, value in sorted(values.items()) if value is not None]
        _draw_line(axes, line, line[-1:], look)


def _draw_measured(counts: Axes, times: Axes, rows: Sequence[CostRow], looks: Looks) -> None:
    """Draw counts and times of a step."""
    counts.set_title(f"line-up scenario, |S| = {RULES}, |A| = {ACTIONS}", loc="left")
    counts.set_ylabel("log10(rule evaluations per step)")
    times.set_title("the same, timed", loc="left")
    times.set_ylabel("log10(seconds per step)")
    for name, look in looks.items():
        own = [r for r in rows if (r.topology if r.nested_exact else SINGLE_AGENT) == name]
        known = [(r.agents, r.extra) for r in own if "decision_ms" in r.extra]
        if not known:
            continue
        formula = [(n, log10(step["rule_evaluations_formula_per_step"])) for n, step in known]
        counted = [(n, log10(step["rule_evaluations_per_step"])) for n, step in known]
        timed = [(n, log10((step["decision_ms"] + step["learning_ms"]) / 1e3)) for n, step in known]
        shift = timed[-1][1] - formula[-1][1]
        _draw_line(counts, formula, counted, look)
        _draw_line(times, [(n, value + shift) for n, value in formula], timed, look)


def _draw_line(axes: Axes, line: Points, marked: Points, look: Mapping[str, Any]) -> None:
    axes.plot(*zip(*line, strict=True), **{**look, "marker": ""})
    axes.plot(*zip(*marked, strict=True), **{**look, "ls": ""}, markerfacecolor="none")


def _scale(axes: Axes, sizes: Sequence[int]) -> None:
    """Scale the axes: numbers of agents that are not equally spaced are logarithmic."""
    axes.set_xlabel("number of agents n")
    if len({after - before for before, after in pairwise(sizes)}) > 1:
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_locator(LogLocator(base=2))
    else:
        axes.xaxis.set_major_locator(_integers())
    axes.yaxis.set_major_locator(_integers())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.grid(alpha=0.25)


def _integers() -> MaxNLocator:
    return MaxNLocator(integer=True, nbins=8, steps=[1, 2, 5, 10], min_n_ticks=1)


def _handle(name: str, look: Mapping[str, Any]) -> Line2D:
    return figures.handle(name, **look, markerfacecolor="none")


def _log10(value: int) -> float:
    return float(Decimal(value).log10())
