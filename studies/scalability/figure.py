"""The figure of scalability: performance, efficiency, a cost, and performance against the cost."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..presentation import figures
from ..results.statistics import NOT_NEGATIVE, Estimate
from .analysis import HEADINGS, Scalability
from .data import Cells
from .inference import bounded_mean


def draw(analysis: Scalability) -> Figure:
    """Return the figure of four panels; bars are 95% intervals over seeds.

    The cost is the first that was measured. In the last panel a filled point is on the Pareto front
    of the largest size.
    """
    data = analysis.data
    with figures.apply_style():
        figure, panels = figures.panels(2, 2, (7.2, 5.6))
        performance, efficiency, cost, front = panels.flat
        _draw_cells(performance, analysis, data.performances, data.performance.bounds)
        performance.set_ylabel(data.performance_title)
        if data.performance.is_rate:
            figures.as_rates(performance)
        _draw_efficiency(efficiency, analysis)
        if data.costs:
            name = next(iter(data.costs))
            _draw_cells(cost, analysis, data.costs[name], NOT_NEGATIVE)
            cost.set_ylabel(HEADINGS.get(name, name))
            figures.log_axis(cost)
            _draw_front(front, analysis, name)
        for axes in (performance, efficiency, cost):
            axes.set_xlabel(data.size)
            figures.scale_axis(axes, [round(n) for n in data.all_sizes])
        for axes in panels.flat:
            axes.grid(alpha=0.25)
        figures.name_lines(figure, list(data.hierarchies), "means over seeds, bars: 95% intervals")
    return figure


def _draw_cells(
    axes: Axes, analysis: Scalability, cells: Cells, bounds: tuple[float, float]
) -> None:
    data = analysis.data
    for index, name in enumerate(data.hierarchies):
        sizes = [n for n in data.sizes(name) if (name, n) in cells]
        estimates = [bounded_mean(cells[name, n], bounds) for n in sizes]
        _draw_line(axes, analysis, index, sizes, estimates)


def _draw_efficiency(axes: Axes, analysis: Scalability) -> None:
    for index, name in enumerate(analysis.data.hierarchies):
        own = analysis.speedups.get(name, {})
        _draw_line(axes, analysis, index, list(own), [s.efficiency for s in own.values()])
    axes.axhline(1.0, color="#888888", linewidth=0.8, ls=":")
    axes.set_ylabel(f"efficiency ({analysis.data.scaling} scaling)")
    axes.set_ylim(bottom=0.0)


def _draw_line(
    axes: Axes,
    analysis: Scalability,
    index: int,
    sizes: list[float],
    estimates: list[Estimate],
) -> None:
    if sizes:
        count = len(analysis.data.hierarchies)
        figures.draw_line(axes, [round(n) for n in sizes], estimates, index, count)


def _draw_front(axes: Axes, analysis: Scalability, cost: str) -> None:
    """Draw performance against cost at the largest size."""
    data = analysis.data
    largest = data.all_sizes[-1]
    for point in analysis.fronts:
        if point.cost == cost and point.size == largest:
            color = figures.look(data.hierarchies.index(point.hierarchy))["color"]
            face = color if point.on_front else "white"
            axes.plot(
                point.cost_value, point.performance, "o", color=color, markerfacecolor=face, ms=7
            )
    axes.set_xlabel(f"{HEADINGS.get(cost, cost)}, {largest:g} {data.size}")
    axes.set_ylabel(data.performance_title)
    figures.log_axis(axes, "x")
    if data.performance.is_rate:
        figures.as_rates(axes)
    axes.set_title("filled: on the Pareto front", loc="left")
