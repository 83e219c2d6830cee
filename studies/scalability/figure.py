"""The figure of scalability: performance, efficiency, a cost, and performance against the cost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..presentation import figures
from ..results.statistics import Estimate
from .analysis import Scalability
from .data import COSTS, Place

LAW_POINTS = 60
"""Points of the line of a law."""
MAX_EFFICIENCY = 1.2
"""Efficiency that its axis always shows."""


def draw(analysis: Scalability) -> Figure:
    """Return the figure of four panels; bars are 95% intervals over seeds.

    Thin lines of the efficiency show the universal scalability law where it describes the times.
    The cost is the first that was measured. In the last panel a filled point is on the Pareto front
    of the largest size.
    """
    data = analysis.data
    with figures.apply_style():
        figure, panels = figures.panels(2, 2, (7.2, 5.6))
        performance, efficiency, cost, front = panels.flat
        _draw_cells(performance, analysis, data.performance_estimates)
        performance.set_ylabel(data.performance_title)
        if data.performance.is_rate:
            figures.as_rates(performance)
        _draw_efficiency(efficiency, analysis)
        if data.costs:
            name = next(iter(data.costs))
            _draw_cells(cost, analysis, analysis.cost_estimates[name])
            cost.set_ylabel(COSTS[name].heading)
            figures.log_axis(cost)
            _draw_front(front, analysis, name)
        for axes in (performance, efficiency, cost):
            axes.set_xlabel(data.size)
            figures.scale_axis(axes, [round(n) for n in data.all_sizes])
        for axes in panels.flat:
            axes.grid(alpha=0.25)
        figures.name_lines(figure, list(data.hierarchies), "means over seeds, bars: 95% intervals")
    return figure


def _draw_cells(axes: Axes, analysis: Scalability, estimates: Mapping[Place, Estimate]) -> None:
    data = analysis.data
    for index, name in enumerate(data.hierarchies):
        sizes = [n for n in data.sizes(name) if (name, n) in estimates]
        _draw_line(axes, analysis, index, sizes, [estimates[name, n] for n in sizes])


def _draw_efficiency(axes: Axes, analysis: Scalability) -> None:
    """Draw efficiencies; intervals are cut at twice the largest value, as they may be very wide."""
    largest = highest = MAX_EFFICIENCY
    for index, name in enumerate(analysis.data.hierarchies):
        own = [
            (size, speedup.efficiency) for size, speedup in analysis.speedups.get(name, {}).items()
        ]
        _draw_line(axes, analysis, index, [size for size, _ in own], [e for _, e in own])
        _draw_law(axes, analysis, index, name)
        largest = max([largest, *(float(e.value) for _, e in own if np.isfinite(e.value))])
        highest = max([highest, *(float(e.high) for _, e in own if np.isfinite(e.high))])
    axes.axhline(1.0, color="#888888", linewidth=0.8, ls=":")
    axes.set_ylabel(f"efficiency ({analysis.data.scaling} scaling)")
    axes.set_ylim(0.0, 1.1 * min(highest, 2.0 * largest))


def _draw_law(axes: Axes, analysis: Scalability, index: int, name: str) -> None:
    """Draw the efficiency by the universal scalability law, if it describes the times."""
    law, times = analysis.laws.get(name), analysis.data.times_of(name)
    if law is None or times is None or not law.is_plausible:
        return
    factors = np.geomspace(1.0, times.factors[-1], LAW_POINTS)
    measured = float(times.values[:, 0].mean())
    efficiency = law.throughput(factors) / factors * measured / law.time_at_smallest
    color = figures.look(index)["color"]
    axes.plot(times.sizes[0] * factors, efficiency, color=color, lw=0.8, alpha=0.6)


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
    beaten = {
        point.hierarchy
        for point in analysis.fronts
        if (point.cost, point.size) == (cost, largest) and not point.on_front
    }
    for name in data.at_size(largest):
        if (name, largest) in analysis.cost_estimates[cost]:
            color = figures.look(data.hierarchies.index(name))["color"]
            x = analysis.cost_estimates[cost][name, largest].value
            y = data.performance_estimates[name, largest].value
            face = "white" if name in beaten else color
            axes.plot(x, y, "o", color=color, markerfacecolor=face, ms=7)
    axes.set_xlabel(f"{COSTS[cost].heading}, {largest:g} {data.size}")
    axes.set_ylabel(data.performance_title)
    figures.log_axis(axes, "x")
    if data.performance.is_rate:
        figures.as_rates(axes)
    axes.set_title("filled: on the Pareto front", loc="left")
