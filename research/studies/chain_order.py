"""The chain-order study: whether it matters who is above whom in a chain.

The paper calls its chain "in fact arbitrary" (Section X-A). Conditions are orders of the agents;
all meet the same worlds, seed by seed. Two measures were fixed beforehand: how fast a team learns
(success over all of training) and how well it ends (evaluation success). For each,
Friedman's test asks whether the orders differ at all, p adjusted by Holm's method over the two
tests; and every order is compared with the first one as the study `ablation` compares.

If there are overrides, such as one for each kind of learner, orders are compared within each of
them, by evaluation success alone, and a verdict says whether they are equal but for `MARGIN`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nested_agents import Analysis, Study
from nested_agents.analysis import (
    LEVEL,
    ComparisonGroup,
    Figures,
    Friedman,
    Results,
    compare_conditions,
    compare_with_first,
    format_number,
    format_p,
    friedman,
    holm,
    phases_of,
    select_shared,
)

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
MARGIN = 0.1
"""Orders whose differences from the first have intervals within it are taken for equal."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("training")
    if any({"name", "topology"} <= results.columns.get(c, {}).keys() for c in conditions):
        by_order = compare_conditions(results, results.main.name, by="topology")
        groups = [group for group in by_order.groups if group.differences]
        equal = map(equivalence, groups) if results.main.is_rate else ()  # `MARGIN` is of rates
        notes = (*equal, *by_order.notes)
        return Analysis(by_order.table, notes, (), {g.setting: g.differences for g in groups})
    compared = compare_with_first(results, shorten_orders(conditions))
    tests = order_tests(results)
    notes = (*(test.verdict for test in tests), *compared.notes, *_legend(conditions))
    return replace(compared, notes=notes, cases=tests)


def equivalence(group: ComparisonGroup) -> str:
    """Return whether the orders of a group are equal but for `MARGIN`, in words."""
    low = min(float(d.estimate.low) for d in group.differences)
    high = max(float(d.estimate.high) for d in group.differences)
    if any(d.p < LEVEL for d in group.differences):
        verdict = "the order matters"
    else:
        verdict = "equal" if max(-low, high) <= MARGIN else "not decided"
    orders = len(group.differences) + 1
    ends = f"[{format_number(low)}, {format_number(high)}]"
    return f"{group.setting}, {orders} orders, within {MARGIN:g}: {verdict} {ends}"


class OrderTest(NamedTuple):
    """Whether the orders differ at all by one measure."""

    title: str
    """The measure."""
    orders: int
    """How many there are."""
    seeds: int
    """How many seeds all orders have finished."""
    test: Friedman
    """The test."""
    p: float
    """Its p, adjusted over the measures."""

    @property
    def verdict(self) -> str:
        """What the test found, in words."""
        differ = "differ" if self.p < LEVEL else "do not differ significantly"
        return (
            f"{self.title}: {self.orders} orders {differ} (Friedman "
            f"{format_number(self.test.statistic)}, p {format_p(self.test.p)}, adjusted "
            f"{format_p(self.p).removeprefix('= ')}; W = {format_number(self.test.concordance)}; "
            f"{self.seeds} seeds)"
        )


def order_tests(results: Results) -> tuple[OrderTest, ...]:
    """Return the tests of all orders together, one for each measure that all of them have."""
    conditions = results.of_phase("training")
    tests = []
    for title, phase in phases_of(results).items() if len(conditions) > 1 else ():
        means = [results.means(condition, phase, results.main.name) for condition in conditions]
        values = np.stack(select_shared(means), axis=1)
        if len(values) >= 2:
            test = friedman(values)
            tests.append(OrderTest(title, len(conditions), len(values), test, test.p))
    adjusted = holm([test.p for test in tests])
    return tuple(test._replace(p=float(p)) for test, p in zip(tests, adjusted, strict=True))


def shorten_orders(orders: Sequence[str]) -> list[str]:
    """Return labels of orders with agents by number, as in the first one that names them.

    Examples
    --------
    >>> shorten_orders(("chain:r1.a,r1.b", "chain:r1.b,r1.a"))
    ['1 2', '2 1']
    >>> shorten_orders(("chain", "chain:reversed"))
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


def draw(analysis: Analysis) -> Figures:
    """Return the figure: what each order differs from the first one by."""
    from nested_agents.figures import draw_forest

    return draw_forest("chain-order", analysis.differences, "difference from the first order")


class ChainOrderStudy(Study):
    """Compares orders of the agents of a chain."""

    PUBLISHED = PUBLISHED
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
