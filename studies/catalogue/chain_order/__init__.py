"""The chain-order study: whether it matters who is above whom in a chain.

The paper calls its chain "in fact arbitrary" (Section X-A). Conditions are orders of the agents;
all meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a team learns
(success over all of training) and how well it ends (evaluation success). For each,
Friedman's test asks whether the orders differ at all, p adjusted by Holm's method over the two
tests; and every order is compared with the first one as the study `ablation` compares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...results.analysis import Analysis, Figures
from ...results.comparison import aligned, mean_success
from ...results.paired_tests import LEVEL, Friedman, friedman, holm
from ...results.results import Results
from ...results.statistics import bootstrap
from ..ablation import compared_with_first, phases_of
from ..study import run_training as measure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""


@dataclass(frozen=True)
class OrderComparison:
    """All orders by one measure."""

    title: str
    """The measure."""
    values: NDArray[np.float64]
    """``(n_seeds, n_orders)``, seeds that all orders have finished."""
    test: Friedman
    """Whether the orders differ at all."""
    p: float
    """Its p, adjusted over the measures."""

    @property
    def verdict(self) -> str:
        """What the test found, in words."""
        n, k = self.values.shape
        differ = "differ" if self.p < LEVEL else "do not differ significantly"
        return (
            f"{self.title}: {k} orders {differ} (Friedman {self.test.statistic:.1f}, "
            f"p = {self.test.p:.2g}, adjusted {self.p:.2g}; W = {self.test.concordance:.3f}; "
            f"{n} seeds)"
        )


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("training")
    compared = compared_with_first(results, shortened(conditions))
    orders = compare_orders(results)
    notes = (*(one.verdict for one in orders), *compared.notes, *_legend(conditions))
    return replace(compared, notes=notes, cases=orders)


def shortened(orders: Sequence[str]) -> list[str]:
    """Return labels of orders with agents by number, as in the first one that names them.

    Examples
    --------
    >>> shortened(("chain:r1.a,r1.b", "chain:r1.b,r1.a"))
    ['1 2', '2 1']
    >>> shortened(("chain", "chain:reversed"))
    ['chain', 'reversed']
    """
    named = [order.removeprefix("chain:").split(",") for order in orders]
    first = named[0] if named and len(named[0]) > 1 else []  # else it does not name them
    number = {name: str(k + 1) for k, name in enumerate(first)}
    return [" ".join(number.get(name, name) for name in names) for names in named]


def _legend(orders: Sequence[str]) -> list[str]:
    named = orders[0].removeprefix("chain:").split(",") if orders else []
    numbered = (f"{k + 1} = {name}" for k, name in enumerate(named))
    return [f"agents: {', '.join(numbered)}"] if len(named) > 1 else []


def compare_orders(results: Results) -> tuple[OrderComparison, ...]:
    """Return the comparisons of all orders, one for each measure that all orders have."""
    conditions = results.of_phase("training")
    made = []
    for title, phase in phases_of(results).items() if len(conditions) > 1 else ():
        values = np.stack(aligned(results, conditions, mean_success(phase)), axis=1)
        if len(values) >= 2:
            made.append((title, values, friedman(values)))
    ps = holm([test.p for *_, test in made])
    return tuple(OrderComparison(*own, float(p)) for own, p in zip(made, ps, strict=True))


def draw(analysis: Analysis) -> Figures:
    """Return the figure: every order with its interval, sorted, and every seed.

    Points are means over seeds, bars their 95 % intervals, grey the seeds; the first condition,
    the paper's order, is drawn in another colour and its mean as a line.
    """
    from ...presentation.figures import name_rows, panels  # matplotlib takes its time

    comparisons = analysis.cases
    if not comparisons:
        return {}
    labels = [line.condition for line in analysis.table]
    width = 2.2 + 0.07 * max(map(len, labels)) + 2.6 * len(comparisons)
    figure, axes = panels(1, len(comparisons), (width, 1.3 + 0.2 * len(labels)), sharey=True)
    rank = np.argsort(-comparisons[0].values.mean(axis=0), kind="stable")
    for panel, comparison in zip(axes[0], comparisons, strict=True):
        _panel(panel, comparison, rank)
    name_rows(axes[0, 0], [labels[i] for i in rank])
    return {"chain-order": figure}


def _panel(axes: Axes, comparison: OrderComparison, rank: NDArray[np.intp]) -> None:
    from ...presentation.figures import COLOURS, draw_row

    rng = np.random.default_rng(0)  # spreads the seeds' dots, nothing else
    for row, i in enumerate(rank):
        seeds = comparison.values[:, i]
        spread = row + rng.uniform(-0.25, 0.25, len(seeds))
        axes.plot(seeds, spread, ".", color="#cccccc", markersize=3, zorder=1)
        colour = COLOURS[1] if i == 0 else COLOURS[0]
        draw_row(axes, row, bootstrap(seeds), colour, markersize=4, zorder=3)
    first = comparison.values[:, 0].mean()
    axes.axvline(first, color=COLOURS[1], linewidth=0.8, linestyle=":")
    axes.set_title(f"{comparison.title}\nFriedman p = {comparison.test.p:.2g}", loc="left")
    axes.set_xlabel("rate")
    axes.grid(axis="x", alpha=0.25)


__all__ = ["analyse", "draw", "measure"]
