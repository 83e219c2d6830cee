"""The chain-order study: whether it matters who is above whom in a chain.

The paper calls its chain "in fact arbitrary" (Section X-A). Conditions are orders of the agents;
all meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a team learns
(success over all of training) and how well it ends (evaluation success). For each,
Friedman's test asks whether the orders differ at all, and the first condition is compared with each
other one; p-values are adjusted by Holm's method over the two tests, and over all comparisons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...results.comparison import aligned
from ...results.paired_tests import LEVEL, Friedman, friedman, holm, paired_permutation
from ...results.results import Results
from ...results.statistics import bootstrap, rate
from ...results.summary import Summary


@dataclass(frozen=True)
class Rate:
    """What the orders are compared by: the mean of a phase's success rates."""

    title: str
    phase: Literal["training", "evaluation"]

    def of(self, results: Results, condition: str) -> NDArray[np.float64]:
        """Return the values ``(n_seeds,)`` of an order."""
        success = getattr(results, self.phase)[condition]["success"]
        return np.asarray(success.mean(axis=1))


RATES = (
    Rate("success, all training", "training"),
    Rate("evaluation success", "evaluation"),
)


@dataclass(frozen=True)
class Comparison:
    """All orders by one measure.

    Attributes
    ----------
    title
        The measure.
    orders
        Labels of the conditions.
    values
        ``(n_seeds, n_orders)``, seeds that all orders have finished.
    test
        Whether the orders differ at all.
    p
        Its p, adjusted over the measures.
    against_first
        ``(n_orders - 1,)`` p of every other order against the first, adjusted over all of them and
        all measures.
    """

    title: str
    orders: tuple[str, ...]
    values: NDArray[np.float64]
    test: Friedman
    p: float
    against_first: NDArray[np.float64]

    @property
    def resolution(self) -> float:
        """Half the median width of the 95 % intervals of the differences, unadjusted."""
        found = bootstrap(self.values[:, 1:] - self.values[:, :1])
        return float(np.median(found.high - found.low)) / 2.0


@dataclass(frozen=True)
class ChainOrders:
    """The analysis.

    Attributes
    ----------
    table
        One line per order.
    comparisons
        One per measure.
    notes
        The verdict, for printing.
    """

    table: tuple[Summary, ...]
    comparisons: tuple[Comparison, ...]
    notes: tuple[str, ...]


def analyse(results: Results) -> ChainOrders:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = list(results.training)
    names = shortened(conditions)
    table = []
    for condition, name in zip(conditions, names, strict=True):
        estimates = {
            m.title: rate(phase[condition]["success"])
            for m in RATES
            if condition in (phase := getattr(results, m.phase))
        }
        seeds = len(results.training[condition]["success"])
        table.append(Summary(name, seeds, estimates))
    comparisons = _compared(results, conditions, names)
    return ChainOrders(tuple(table), comparisons, (*_verdict(comparisons), *_legend(conditions)))


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


def _compared(results: Results, conditions: list[str], names: list[str]) -> tuple[Comparison, ...]:
    found = []
    for m in RATES if len(conditions) > 1 else ():
        phase = getattr(results, m.phase)
        if any(condition not in phase for condition in conditions):
            continue
        values = np.stack(aligned(results, conditions, m.of), axis=1)
        if len(values) < 2:
            continue
        against = np.array([paired_permutation(c, values[:, 0]) for c in values.T[1:]])
        found.append((m.title, values, friedman(values), against))
    if not found:
        return ()
    omnibus = holm([test.p for _, _, test, _ in found])
    adjusted = holm(np.concatenate([against for *_, against in found])).reshape(len(found), -1)
    return tuple(
        Comparison(title, tuple(names), values, test, float(p), ps)
        for (title, values, test, _), p, ps in zip(found, omnibus, adjusted, strict=True)
    )


def _verdict(comparisons: tuple[Comparison, ...]) -> list[str]:
    lines = []
    for c in comparisons:
        n, k = c.values.shape
        means = c.values.mean(axis=0)
        best, worst = int(means.argmax()), int(means.argmin())
        differ = "differ" if c.p < LEVEL else "do not differ significantly"
        named = int((c.against_first < LEVEL).sum())
        lines.append(
            f"{c.title}: {k} orders {differ} (Friedman {c.test.statistic:.1f}, p = {c.test.p:.2g}, "
            f"adjusted {c.p:.2g}; W = {c.test.concordance:.3f}; {n} seeds)"
        )
        lines.append(
            f"  {named} of {k - 1} differ from the first (least p {c.against_first.min():.2g}, "
            f"adjusted); intervals of the differences reach {c.resolution:.2f} to either side"
        )
        lines.append(
            f"  best {c.orders[best]}: {means[best]:.3f}; worst {c.orders[worst]}: "
            f"{means[worst]:.3f}; first: {means[0]:.3f}"
        )
    return lines
