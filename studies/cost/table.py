"""Tables of costs: a row for every topology, number of agents, rules and actions."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import chain, product
from math import prod
from numbers import Integral
from typing import Any

from ...core.agents.cost import Problem, is_chain
from ...core.plugins.words import expect, expect_each, expect_within
from .cost import (
    DECISION_METHODS,
    MEMBERSHIPS,
    PAPER,
    SINGLE_AGENT,
    Columns,
    CostRow,
    agents_below,
    joint_actions,
    measure,
    messages,
    within_budget,
)
from .formats import VARIABLES, format_rows

MAX_ROWS = 100_000
MAX_COUNT = 10**15
"""Maximum of iterations, rules and the budget."""
RANGES = {
    "agents": (1, 10_000),  # the integers of a row then have some fifty thousand digits
    "memberships": (1, 1_000),
    "rules": (1, MAX_COUNT),
    "actions": (2, 10_000),
}
"""Minimum and maximum of the numbers that a table may vary."""
LABELED = re.compile(r"([\w -]+)=(.+)")
"""A topology with a label of its own."""


@dataclass(frozen=True)
class CostTable:
    """Costs, a row for every topology, number of agents, and number of rules and actions.

    It is printed, or shown by a notebook, as text.
    """

    rows: tuple[CostRow, ...]
    """The costs as exact integers."""

    @property
    def csv(self) -> str:
        """The table as CSV, with every digit."""
        return format_rows(self.rows, "csv")

    @property
    def latex(self) -> str:
        """The table for LaTeX, with the package booktabs."""
        return format_rows(self.rows, "latex")

    def __str__(self) -> str:
        return format_rows(self.rows, "table")

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def problems(
    memberships: Iterable[int] | None = None,
    rules: Iterable[int] | None = None,
    actions: Iterable[int] = (PAPER.actions,),
    iterations: int = PAPER.iterations,
) -> list[tuple[int | None, Problem]]:
    """Return each combination of rules and actions, with its membership functions if given.

    Parameters
    ----------
    memberships
        Membership functions of each of the seven state variables: an agent has as many rules as
        they have combinations. By default 5, as in the paper, unless rules are given.
    rules
        Rules |S| of an agent, instead of membership functions.
    actions
        Actions |A| of an agent.
    iterations
        Iterations L.

    Raises
    ------
    ValueError
        If memberships and rules are both given, or a number is out of range; one line.
    """
    if rules is not None and memberships is not None:
        raise ValueError(
            "memberships and rules are both given, allowed: one of them, because rules = "
            f"memberships ** {VARIABLES}"
        )
    _check_count("iterations", iterations)
    sizes: list[tuple[int | None, int]]
    if rules is not None:
        sizes = [(None, count) for count in _checked("rules", rules)]
    else:
        given = (MEMBERSHIPS,) if memberships is None else memberships
        sizes = [(m, m**VARIABLES) for m in _checked("memberships", given)]
    return [
        (m, Problem(count, each, iterations))
        for (m, count), each in product(sizes, _checked("actions", actions))
    ]


def _check_count(name: str, number: int) -> None:
    expect("a whole number", Integral, **{name: number})
    expect_within(f"1 to {MAX_COUNT:,}", 1, MAX_COUNT, **{name: number})


def _checked(name: str, numbers: Iterable[int]) -> list[int]:
    """Return whole numbers of a kind in `RANGES`, each once.

    Raises
    ------
    ValueError
        If there are none, or one is no whole number or out of range; one line.
    """
    low, high = RANGES[name]
    allowed = f"whole numbers from {low} to {high:,}"
    expect(allowed, Iterable, **{name: numbers})
    each = list(numbers)
    if not each:
        raise ValueError(f"{name} = [], allowed: {allowed}, at least one")
    expect_each(allowed, Integral, **{name: each})
    for index, number in enumerate(each):
        expect_within(allowed, low, high, **{f"{name}[{index}]": number})
    return list(dict.fromkeys(map(int, each)))


def cost_table(
    topologies: Sequence[str] = ("chain",),
    agents: Iterable[int] = (4,),
    *,
    budget: int | None = None,
    measured: bool = False,
    network: bool = False,
    **quantities: Any,
) -> CostTable:
    """Return the cost of hierarchies by Eq. 18-23 and, if requested, measured.

    Parameters
    ----------
    topologies
        As in a spec, or ``label=topology``; ``single-agent``, or ways to decide: ``best-response``,
        ``max-plus``, ``fitted-q``, ``hierarchy-ppo``.
    agents
        Numbers of agents.
    budget
        Number of joint actions that the team may try in a decision, as with the spec key
        ``learner.decision.budget``. The table then also has the cost within this budget.
    measured
        Whether to count and time steps of the running system, too.
    network
        Whether to count the messages of a decision, and how many of them follow one another.
    **quantities
        ``memberships=[3, 5]`` or ``rules=[2187]``, ``actions=[4, 6]`` and ``iterations=450``, see
        `problems`; by default those of the paper.

    Raises
    ------
    ValueError
        If there is no topology, one or a number is refused, or two have one label; one line.

    Examples
    --------
    >>> table = cost_table(["chain"], [4], memberships=[3, 5], actions=[4, 6])
    >>> [(row.memberships, row.problem.actions, row.nested_exact) for row in table.rows][2]
    (5, 4, 2457562500000)
    """
    expect("names of topologies", Sequence | None, topologies=topologies)
    expect_each("names of topologies", str, topologies=topologies)
    numbers = _checked("agents", agents)
    if not topologies:
        raise ValueError("topology = none, allowed: one or more, such as chain or tree:2")
    if budget is not None:
        _check_count("budget", budget)
    each = problems(**quantities)
    count = prod(map(len, (topologies, numbers, each)))
    if count > MAX_ROWS:
        raise ValueError(f"{count:,} rows, allowed: {MAX_ROWS:,}; name fewer numbers")
    by_case = []
    for (label, text), n in product(_labeled(topologies), numbers):
        extra: Columns = messages(text, n) if network else {}
        extra |= measure(text, n) if measured else {}
        own = []
        for memberships, problem in each:
            row = replace(_row(text, n, problem), topology=label, memberships=memberships)
            limited: Columns = {}
            if budget is not None:
                limited = within_budget(row, joint_actions(text, n, problem.actions), budget)
            own.append(replace(row, extra=limited | extra))
        by_case.append(own)
    return CostTable(tuple(chain.from_iterable(zip(*by_case, strict=True))))


def _row(text: str, n: int, problem: Problem) -> CostRow:
    """Return the row of a topology over n agents with the results of the formulas."""
    below = () if text in {SINGLE_AGENT, *DECISION_METHODS} else agents_below(text, n)
    is_one = bool(below) and is_chain(below)
    needs = joint_actions(text, n, problem.actions)
    return CostRow(
        n,
        text,
        problem,
        nested_exact=None if text == SINGLE_AGENT else problem.sweep(needs),
        nested_closed_form=problem.chain_closed_form(n) if is_one else None,
        nested_asymptotic=problem.chain_asymptotic(n) if is_one else None,
        single_agent=problem.single_agent(n),
        free=1 + max(below, default=-1),
    )


def _labeled(topologies: Sequence[str]) -> list[tuple[str, str]]:
    """Return label and text of each topology; refuse two of one label."""
    matches = [LABELED.fullmatch(text) for text in topologies]
    named = [(m[1], m[2]) if m else (t, t) for m, t in zip(matches, topologies, strict=True)]
    labels = [label for label, _ in named]
    for label, text in named:
        if labels.count(label) > 1:
            raise ValueError(f"topology = {label!r} more than once; name each: LABEL={text}")
    return named
