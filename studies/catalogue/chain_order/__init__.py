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

from ...results.analysis import Analysis, Figures
from ...results.comparison import order_tests
from ...results.contrasts import Group, contrasts
from ...results.paired_tests import LEVEL
from ...results.results import Results
from ...results.summary import two_figures
from .. import ablation
from ..study import run_training as measure

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
MARGIN = 0.1
"""Orders whose differences from the first have intervals within it are taken for equal."""


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    conditions = results.of_phase("training")
    if any({"name", "topology"} <= results.columns.get(c, {}).keys() for c in conditions):
        by_order = contrasts(results, by="topology")
        groups = [group for group in by_order.groups if group.differences]
        notes = (*map(equivalence, groups), *by_order.notes)
        return Analysis(by_order.table, notes, (), {g.setting: g.differences for g in groups})
    compared = ablation.compared_with_first(results, shortened(conditions))
    tests = order_tests(results)
    notes = (*(test.verdict for test in tests), *compared.notes, *_legend(conditions))
    return replace(compared, notes=notes, cases=tests)


def equivalence(group: Group) -> str:
    """Return whether the orders of a group are equal but for `MARGIN`, in words."""
    lows, highs = zip(*((d.estimate.low, d.estimate.high) for d in group.differences), strict=True)
    low, high = min(lows), max(highs)
    if any(d.p < LEVEL for d in group.differences):
        verdict = "the order matters"
    else:
        verdict = "equal" if max(-low, high) <= MARGIN else "not decided"
    ends = f"{two_figures(low)} to {two_figures(high)}"
    return f"{group.setting}, {len(lows) + 1} orders, within {MARGIN:g}: {verdict} ({ends})"


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


def draw(analysis: Analysis) -> Figures:
    """Return the figure: what each order differs from the first one by."""
    from ...presentation.figures import draw_forest

    figure = draw_forest(analysis.differences, "difference from the first order")
    return {} if figure is None else {"chain-order": figure}


__all__ = ["analyse", "draw", "measure"]
