"""The figure of scalability: performance, efficiency, a cost, and performance against the cost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..laws.universal import relative_sizes
from ..presentation import figures
from ..results.statistics import Estimate
from .analysis import Scalability
from .data import HEADINGS, Place

LAW_POINTS = 60
"""Points of the line of a law."""
LAW_WIDTH = 0.8
"""Width of the line of a law, which has the color of its hierarchy."""
MAX_EFFICIENCY = 1.2
"""Efficiency that its axis always shows."""


def draw(report: Scalability) -> Figure:
    """Return the figure of four panels; bars are 95% intervals over seeds.

    Thin lines of the efficiency show the universal scalability law where it describes the times.
    The cost is the first that was measured. In the last panel a filled point is on the Pareto front
    of the largest size.
    """
    data = report.data
    with figures.apply_style():
        figure, panels = figures.panels(2, 2, (7.2, 5.6))
        performance, efficiency, cost, front = panels.flat
        _draw_cells(performance, report, data.performance_estimates)
        performance.set_ylabel(data.performance_title)
        if data.performance.is_rate:
            figures.as_rates(performance)
        _draw_efficiency(efficiency, report)
        if data.costs:
            name = next(iter(data.costs))
            _draw_cells(cost, report, report.cost_estimates[name])
            cost.set_ylabel(HEADINGS[name])
            figures.log_axis(cost)
            _draw_front(front, report, name)
        for axes in (performance, efficiency, cost):
            axes.set_xlabel(data.size)
            figures.scale_axis(axes, [round(n) for n in data.all_sizes])
        for axes in panels.flat:
            axes.grid(alpha=0.25)
        has_law = any(law.is_plausible for law in report.universal_laws.values())
        others = (
            [figures.handle("universal scalability law", color="#444444", lw=LAW_WIDTH)]
            if has_law
            else []
        )
        title = "means over seeds, bars: 95% intervals"
        figures.name_lines(figure, list(data.hierarchies), title, others)
    return figure


def _draw_cells(axes: Axes, report: Scalability, estimates: Mapping[Place, Estimate]) -> None:
    """Draw a line of estimates for each hierarchy."""
    hierarchies = report.data.hierarchies
    for index, name in enumerate(hierarchies):
        known = {round(n): e for (other, n), e in sorted(estimates.items()) if other == name}
        if known:
            own = [*known.values()]
            figures.draw_line(axes, [*known], own, index, len(hierarchies))


def _draw_efficiency(axes: Axes, report: Scalability) -> None:
    """Draw efficiencies; intervals are cut at twice the largest value, as they may be very wide."""
    efficiencies = {
        (name, n): own["efficiency"]
        for name, by_size in report.speedups.items()
        for n, own in by_size.items()
    }
    _draw_cells(axes, report, efficiencies)
    for name in report.universal_laws:
        _draw_law(axes, report, name)
    values = np.array([(e.value, e.high) for e in efficiencies.values()]).reshape(-1, 2)
    known = np.where(np.isfinite(values), values, MAX_EFFICIENCY)
    largest, highest = known.max(axis=0, initial=MAX_EFFICIENCY).tolist()
    axes.axhline(1.0, color="#888888", linewidth=0.8, ls=":")
    scaling = report.data.scaling
    axes.set_ylabel(f"efficiency ({scaling} scaling)" if scaling else "efficiency (left out)")
    axes.set_ylim(0.0, 1.1 * min(highest, 2.0 * largest))


def _draw_law(axes: Axes, report: Scalability, name: str) -> None:
    """Draw the efficiency by the universal scalability law, if it describes the times."""
    law, times = report.universal_laws[name], report.times[name]
    if not law.is_plausible:
        return
    factors = np.geomspace(1.0, relative_sizes(times)[-1], LAW_POINTS)
    measured = float(times.iloc[:, 0].mean())
    efficiency = law.throughput(factors) / factors * measured / law.time_at_smallest
    color = figures.look(report.data.hierarchies.index(name))["color"]
    axes.plot(times.columns[0] * factors, efficiency, color=color, lw=LAW_WIDTH)


def _draw_front(axes: Axes, report: Scalability, cost: str) -> None:
    """Draw performance against cost at the largest size."""
    data = report.data
    largest = data.all_sizes[-1]
    points = report.fronts[(report.fronts["cost"] == cost) & (report.fronts["size"] == largest)]
    is_beaten = dict(zip(points["hierarchy"], ~points["on_front"].astype(bool), strict=True))
    for name in data.at_size(largest):
        if (name, largest) in report.cost_estimates[cost]:
            color = figures.look(data.hierarchies.index(name))["color"]
            x = report.cost_estimates[cost][name, largest]
            y = data.performance_estimates[name, largest]
            face = "white" if is_beaten.get(name) else color
            axes.plot([x.low, x.high], [y.value, y.value], color=color, lw=1.0)
            axes.plot([x.value, x.value], [y.low, y.high], color=color, lw=1.0)
            axes.plot(x.value, y.value, "o", color=color, markerfacecolor=face, ms=7)
    axes.set_xlabel(f"{HEADINGS[cost]}, {largest:g} {data.size}")
    axes.set_ylabel(data.performance_title)
    figures.log_axis(axes, "x")
    if data.performance.is_rate:
        figures.as_rates(axes)
    axes.set_title("filled: on the Pareto front", loc="left")
