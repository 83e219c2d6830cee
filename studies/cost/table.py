"""Tables of costs: a row for every topology, number of agents, rules and actions."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import chain, product
from math import prod
from numbers import Integral
from typing import TypedDict, Unpack

from ...core.agents.cost import Problem, is_chain
from ...core.plugins.words import expect, expect_each, expect_within
from .cost import (
    DECISION_METHODS,
    MEMBERSHIPS,
    PAPER,
    SINGLE_AGENT,
    CostRow,
    agents_below,
    broadcasts,
    joint_actions,
    measure,
    messages,
    step_formula,
)
from .formats import VARIABLES, format_rows

MAX_REPEATS = 1000
"""A repeat takes a third of a second or more."""
MAX_ROWS = 100_000
RANGES = {
    "agents": (1, 10_000),  # the integers of a row then have some fifty thousand digits
    "memberships": (1, 1_000),
    "rules": (1, 10**15),
    "actions": (2, 10_000),
}
"""Minimum and maximum of the numbers that a table may vary."""
MAX_ITERATIONS = 10**15
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


class Quantities(TypedDict, total=False):
    """Arguments of `problems`."""

    memberships: Iterable[int] | None
    rules: Iterable[int] | None
    actions: Iterable[int]
    iterations: int


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
    expect("a whole number", Integral, iterations=iterations)
    expect_within(f"1 to {MAX_ITERATIONS:,}", 1, MAX_ITERATIONS, iterations=iterations)
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
    measured: bool = False,
    repeats: int = 1,
    network: bool = False,
    **quantities: Unpack[Quantities],
) -> CostTable:
    """Return the cost of hierarchies by Eq. 18-23 and, if requested, measured.

    Parameters
    ----------
    topologies
        As in a spec, or ``label=topology``; ``single-agent``, or ways to decide: ``best-response``,
        ``max-plus``, ``fitted-q``, ``hierarchy-ppo``.
    agents
        Numbers of agents.
    measured
        Whether to count and time steps of the running system, too.
    repeats
        Number of timings, each with a new team; two or more give an interval.
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
    if not 1 <= repeats <= MAX_REPEATS:
        raise ValueError(f"repeats = {repeats}, allowed: 1 to {MAX_REPEATS}")
    if not topologies:
        raise ValueError("topology = none, allowed: one or more, such as chain or tree:2")
    each = problems(**quantities)
    count = prod(map(len, (topologies, numbers, each)))
    if count > MAX_ROWS:
        raise ValueError(f"{count:,} rows, allowed: {MAX_ROWS:,}; name fewer numbers")
    cases = product(_labeled(topologies), numbers)
    times = repeats if measured else 0
    by_case = [_rows(label, text, n, each, times, network) for (label, text), n in cases]
    return CostTable(tuple(chain.from_iterable(zip(*by_case, strict=True))))


def count_hierarchies(topologies: Sequence[str]) -> int:
    """Return how many of the topologies are not the single agent."""
    return sum(text != SINGLE_AGENT for _, text in _labeled(topologies))


def _labeled(topologies: Sequence[str]) -> list[tuple[str, str]]:
    """Return label and text of each topology; refuse two of one label."""
    matches = [LABELED.fullmatch(text) for text in topologies]
    named = [(m[1], m[2]) if m else (t, t) for m, t in zip(matches, topologies, strict=True)]
    labels = [label for label, _ in named]
    for label, text in named:
        if labels.count(label) > 1:
            raise ValueError(f"topology = {label!r} more than once; name each: LABEL={text}")
    return named


def _rows(
    label: str,
    text: str,
    n: int,
    each: Sequence[tuple[int | None, Problem]],
    repeats: int,
    network: bool,
) -> list[CostRow]:
    """Return the rows of a topology over n agents; without repeats nothing is measured."""
    below = () if text in {SINGLE_AGENT, *DECISION_METHODS} else agents_below(text, n)
    is_one = bool(below) and is_chain(below)
    formula = step_formula(text, n) if repeats else None
    measured = measure(text, n, repeats) if repeats else None
    sent = messages(text, n) if network else None
    broadcast = broadcasts(text, n) if network else 0
    free = 1 + max(below, default=-1)
    rows = []
    for memberships, problem in each:
        tried = None if text == SINGLE_AGENT else joint_actions(text, n, problem.actions)
        row = CostRow(
            agents=n,
            topology=label,
            problem=problem,
            memberships=memberships,
            nested_exact=None if tried is None else problem.sweep(tried),
            nested_closed_form=problem.chain_closed_form(n) if is_one else None,
            nested_asymptotic=problem.chain_asymptotic(n) if is_one else None,
            single_agent=problem.single_agent(n),
            free=free,
            formula=formula,
            measured=measured,
            network=sent,
            broadcast=broadcast,
        )
        rows.append(row)
    return rows
