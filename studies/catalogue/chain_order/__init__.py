"""The chain-order study: whether it matters who is above whom in a chain.

The paper calls its chain "in fact arbitrary" (Section X-A). Conditions are orders of the agents;
all meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a team learns
(success over all of training) and how well it ends (evaluation success). For each,
Friedman's test asks whether the orders differ at all, and the first condition is compared with each
other one; p-values are adjusted by Holm's method over the two tests, and over all comparisons.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...results.analysis import Analysis, Figures
from ...results.comparison import aligned, mean_success
from ...results.paired_tests import LEVEL, Friedman, friedman, holm, paired_permutation
from ...results.results import Results
from ...results.statistics import bootstrap, rate
from ...results.summary import EVALUATED, Summary
from ..study import run_training as measure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
PHASES = {"success, all training": "training", EVALUATED: "evaluation"}
"""What the orders are compared by: success rates in these phases."""


@dataclass(frozen=True)
class OrderComparison:
    """All orders by one measure."""

    title: str
    """The measure."""
    orders: tuple[str, ...]
    """Labels of the conditions."""
    values: NDArray[np.float64]
    """``(n_seeds, n_orders)``, seeds that all orders have finished."""
    test: Friedman
    """Whether the orders differ at all."""
    p: float
    """Its p, adjusted over the measures."""
    against_first: NDArray[np.float64]
    """``(n_orders - 1,)`` p of every other order against the first, adjusted over all of them and
    all measures."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("training")
    names = shortened(conditions)
    table = []
    for condition, name in zip(conditions, names, strict=True):
        estimates = {
            title: rate(results.success(condition, phase))
            for title, phase in PHASES.items()
            if results.has(condition, phase)
        }
        table.append(Summary(name, len(results.seeds(condition)), estimates))
    comparisons = compare_orders(results)
    notes = (*_verdict(comparisons), *_legend(conditions))
    return Analysis(tuple(table), notes, comparisons)


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
    """Return the comparisons of all orders, one for each of `PHASES` that all orders have."""
    conditions = results.of_phase("training")
    made = []
    for title, phase in PHASES.items() if len(conditions) > 1 else ():
        if not all(results.has(condition, phase) for condition in conditions):
            continue
        values = np.stack(aligned(results, conditions, mean_success(phase)), axis=1)
        if len(values) >= 2:
            against = np.array([paired_permutation(c, values[:, 0]) for c in values.T[1:]])
            made.append((title, values, friedman(values), against))
    if not made:
        return ()
    omnibus = holm([test.p for _, _, test, _ in made])
    adjusted = holm(np.concatenate([against for *_, against in made])).reshape(len(made), -1)
    return tuple(
        OrderComparison(title, tuple(shortened(conditions)), values, test, float(p), ps)
        for (title, values, test, _), p, ps in zip(made, omnibus, adjusted, strict=True)
    )


def _verdict(comparisons: Sequence[OrderComparison]) -> Iterator[str]:
    for c in comparisons:
        n, k = c.values.shape
        means = c.values.mean(axis=0)
        best, worst = int(means.argmax()), int(means.argmin())
        differ = "differ" if c.p < LEVEL else "do not differ significantly"
        # Half the median width of their 95 % intervals, unadjusted.
        shifts = bootstrap(c.values[:, 1:] - c.values[:, :1])
        reach = float(np.median(shifts.high - shifts.low)) / 2.0
        named = int((c.against_first < LEVEL).sum())
        yield (
            f"{c.title}: {k} orders {differ} (Friedman {c.test.statistic:.1f}, p = {c.test.p:.2g}, "
            f"adjusted {c.p:.2g}; W = {c.test.concordance:.3f}; {n} seeds)"
        )
        yield (
            f"  {named} of {k - 1} differ from the first (least p {c.against_first.min():.2g}, "
            f"adjusted); intervals of the differences reach {reach:.2f} to either side"
        )
        yield (
            f"  best {c.orders[best]}: {means[best]:.3f}; worst {c.orders[worst]}: "
            f"{means[worst]:.3f}; first: {means[0]:.3f}"
        )


def draw(analysis: Analysis) -> Figures:
    """Return the figure: every order with its interval, sorted, and every seed.

    Points are means over seeds, bars their 95 % intervals, grey the seeds; the first condition,
    the paper's order, is drawn in another colour and its mean as a line.
    """
    from ...presentation.figures import name_rows, panels  # matplotlib takes its time

    comparisons = analysis.cases
    if not comparisons:
        return {}
    labels = comparisons[0].orders
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
