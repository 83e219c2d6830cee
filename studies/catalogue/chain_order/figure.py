"""The figure of the chain-order study: every order with its interval, sorted, and every seed."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...presentation.figures import COLOURS, SETTINGS
from ...results.statistics import bootstrap
from .analysis import ChainOrders, Comparison


def figure_of(analysis: ChainOrders) -> Figure:
    """Return the figure.

    Points are means over seeds, bars their 95 % intervals, grey the seeds; the first condition,
    the paper's order, is drawn in another colour and its mean as a line.
    """
    comparisons = analysis.comparisons
    labels = comparisons[0].orders
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        width = 2.2 + 0.07 * max(map(len, labels)) + 2.6 * len(comparisons)
        figure = Figure(figsize=(width, 1.3 + 0.2 * len(labels)), layout="constrained")
        panels = figure.subplots(1, len(comparisons), sharey=True, squeeze=False)[0]
        rank = np.argsort(-comparisons[0].values.mean(axis=0), kind="stable")
        for axes, comparison in zip(panels, comparisons, strict=True):
            _panel(axes, comparison, rank)
        panels[0].set_yticks(range(len(rank)), [labels[i] for i in rank])
        panels[0].invert_yaxis()
        return figure


def _panel(axes: Axes, comparison: Comparison, rank: np.ndarray) -> None:
    rng = np.random.default_rng(0)  # spreads the seeds' dots, nothing else
    estimates = bootstrap(comparison.values)
    for row, i in enumerate(rank):
        seeds = comparison.values[:, i]
        spread = row + rng.uniform(-0.25, 0.25, len(seeds))
        axes.plot(seeds, spread, ".", color="#cccccc", markersize=3, zorder=1)
        colour = COLOURS[1] if i == 0 else COLOURS[0]
        low, high = estimates.low[i], estimates.high[i]
        axes.plot([low, high], [row, row], color=colour, linewidth=1.5, zorder=2)
        axes.plot(estimates.value[i], row, "o", color=colour, markersize=4, zorder=3)
    axes.axvline(estimates.value[0], color=COLOURS[1], linewidth=0.8, linestyle=":")
    axes.set_title(f"{comparison.title}\nFriedman p = {comparison.test.p:.2g}", loc="left")
    axes.set_xlabel("rate")
    axes.grid(axis="x", alpha=0.25)
