"""Tables of costs for the terminal and as JSON, CSV and LaTeX.

Integers keep every digit in the files. A ratio beyond 2 ** 53, where floating-point numbers cannot
hold every integer, is rounded to an integer.
"""

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, astuple, dataclass
from fractions import Fraction
from html import escape
from itertools import chain, product
from math import prod
from numbers import Integral
from textwrap import wrap
from typing import Literal, TypedDict, Unpack

from ...core.agents.cost import Problem, is_chain
from ...core.evaluators.enumeration import AutoSettings
from ...core.numerics import pd
from ...core.plugins.words import expect, expect_each, expect_within
from ...core.shell import command_line
from ...topologies.view import align, format_count
from ..errors import WIDTH
from ..presentation.tables import in_csv, in_latex
from ..results.notation import format_estimate
from ..results.statistics import Estimate
from .cost import (
    ACTIONS,
    MEMBERSHIPS,
    PAPER,
    RULES,
    SINGLE_AGENT,
    WAYS,
    CostRow,
    StepCost,
    agents_below,
    broadcasts,
    joint_actions,
    measure,
    messages,
    step_formula,
)

Form = Literal["table", "json", "csv", "latex"]
VARIABLES = 7
"""State variables of an agent (Section III): rules = memberships ** VARIABLES."""
QUANTITIES: dict[str, Callable[[CostRow], int | None]] = {
    "memberships": lambda row: row.memberships,
    "rules": lambda row: row.problem.rules,
    "actions": lambda row: row.problem.actions,
}
"""Headings and values of the quantities of the formulas that a table may vary."""
FORMULAS = ("Eq. 18", "Eq. 19", "Eq. 21", "single agent", "ratio")
"""Headings of `CostRow.by_formula`."""
MEASURED = ("formula", "counted", "rules valued", "updates", "ms", "MB")
"""Headings of the measurements of a step."""
NETWORK = ("messages", "in turn", "1 ms", "10 ms", "1 ms*", "10 ms*")
"""Headings of messages, and of the seconds that a decision waits for them."""
OF_THE_PAPER = PAPER.chain_closed_form(4)
"""Operations of four agents by Eq. 19, with the paper's |S|, |A| and L."""


def format_rows(rows: Sequence[CostRow], form: Form) -> str:
    """Return the rows in a format."""
    if form == "table":
        return _table(rows)
    if form == "latex":
        notes = [f"; {_constants(rows)}", "", ""]
        return "\n\n".join(map(_tabular, _cells(rows).values(), notes))
    records = [_record(row) for row in rows]
    most = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)  # those of n = 1000 are more than Python prints
    try:
        if form == "json":
            return "[" + ",\n ".join(json.dumps(record) for record in records) + "]"
        return in_csv(pd.DataFrame(records, dtype=object)).rstrip("\n")
    finally:
        sys.set_int_max_str_digits(most)


def scientific(value: int | Fraction | None) -> str:
    """Return a number for reading: some digits, powers of ten if it is large.

    Examples
    --------
    >>> scientific(2457562500000), scientific(Fraction(5, 2)), scientific(None)
    ('2.458e12', '2.5', '-')
    """
    if value is None:
        return "-"
    if isinstance(value, Fraction) and value.denominator > 1 and value < 1000:
        return f"{float(value):.4g}"
    return format_count(round(value), 10**7)


def _record(row: CostRow) -> dict[str, object]:
    """Return a row with integers as integers; Eq. 21 is rounded to the nearest one."""
    record: dict[str, object] = {"agents": row.agents, "topology": row.topology}
    record |= {name: of(row) for name, of in QUANTITIES.items()}
    record["iterations"] = row.problem.iterations
    record |= row.by_formula
    if row.nested_asymptotic is not None:
        record["nested_asymptotic"] = round(row.nested_asymptotic)
    if row.ratio is not None:
        record["ratio"] = float(row.ratio) if row.ratio < 2**53 else round(row.ratio)
    if row.network is not None:
        record["messages"], record["messages_in_turn"] = row.network
        record["broadcast"] = row.broadcast
    if row.formula is not None:
        counts = asdict(row.formula)
        record |= {"measured_rules": RULES, "measured_actions": ACTIONS}
        record |= {f"{name}_formula_per_step": n for name, n in counts.items()}
    if row.measured is not None:
        record |= _measured_record(row.measured)
    return record


def _measured_record(cost: StepCost) -> dict[str, object]:
    record: dict[str, object] = {f"{name}_per_step": n for name, n in asdict(cost.counted).items()}
    record["deciding_s"] = cost.deciding
    record["learning_s"] = cost.learning
    record["memory_bytes"] = cost.memory
    record["repeats"] = len(cost.repeats)
    record["step_s"] = float(cost.step.value)
    if len(cost.repeats) > 1:
        record["step_s_low"] = float(cost.step.low)
        record["step_s_high"] = float(cost.step.high)
    return record


def _varied(rows: Sequence[CostRow]) -> dict[str, Callable[[CostRow], int | None]]:
    """Return the quantities that have several values."""
    return {name: of for name, of in QUANTITIES.items() if len({of(row) for row in rows}) > 1}


def _cells(rows: Sequence[CostRow]) -> dict[str, list[list[str]]]:
    """Return the cells of each requested table, headings first.

    Measurements and messages do not depend on the varied quantities: they have one line each.
    """
    varied = _varied(rows)
    keys = [[f"{of(row):,}" for of in varied.values()] for row in rows]
    tables = {"topology": [[*varied, "n", "topology", *FORMULAS]]}
    tables["topology"] += [
        [*key, *line] for key, line in zip(keys, _lines(rows, _formula_cells), strict=True)
    ]
    if any(row.formula is not None for row in rows):
        lines = _lines(rows, _measured_cells)
        tables["formula"] = [["n", "topology", *MEASURED], *_distinct(lines)]
    if any(row.network is not None for row in rows):
        lines = _lines(rows, _network_cells)
        tables["network"] = [["n", "topology", *NETWORK], *_distinct(lines)]
    return tables


def _lines(
    rows: Sequence[CostRow], cells: Callable[[CostRow], list[str]]
) -> Iterator[tuple[str, ...]]:
    for row in rows:
        yield str(row.agents), row.topology, *cells(row)


def _distinct(lines: Iterable[tuple[str, ...]]) -> list[list[str]]:
    return list(map(list, dict.fromkeys(lines)))


def _formula_cells(row: CostRow) -> list[str]:
    return [scientific(value) for value in row.by_formula.values()]


def _network_cells(row: CostRow) -> list[str]:
    assert row.network is not None
    waits = (_amount(1e-3 * ms * count) for count in reversed(row.network) for ms in (1, 10))
    return [*(f"{count:,}" for count in row.network), *waits]


def _constants(rows: Sequence[CostRow]) -> str:
    """Return the quantities that are the same in all rows, as the paper writes them."""
    varied = _varied(rows)
    row = rows[0]
    problem = row.problem
    power = f"{row.memberships}^{VARIABLES} = " if row.memberships is not None else ""
    texts = {
        "rules": f"rules |S| = {power}{problem.rules:,}",
        "actions": f"actions |A| = {problem.actions:,}",
        "iterations": f"iterations L = {problem.iterations:,}",
    }
    return ", ".join(text for name, text in texts.items() if name not in varied)


def _legend(rows: Sequence[CostRow]) -> Iterator[str]:
    yield "Operations: nested by Eq. 18, chains by Eq. 19 and 21; single agent by Eq. 23."
    power = f"; rules = memberships^{VARIABLES}" if "memberships" in _varied(rows) else ""
    constants = _constants(rows)
    yield f"{constants[0].upper()}{constants[1:]}{power}."
    if any(row.agents == 4 and row.nested_closed_form == OF_THE_PAPER for row in rows):
        yield (
            "The paper prints 2.45e12 (nested) and 1.1e27 (single agent) for n = 4: it cuts "
            "2.4576e12 of Eq. 21 to three digits and rounds 1.0986e27 of Eq. 23 to two."
        )


def _table(rows: Sequence[CostRow]) -> str:
    tables = _cells(rows)
    n_varied = len(_varied(rows))
    lines = align(tables["topology"], f"{'>' * n_varied}><>>>>>", 2 + n_varied)
    lines += ["", *(line for text in _legend(rows) for line in wrap(text, WIDTH))]
    lines += _of_another_evaluator(rows)
    if "formula" in tables:
        same = [row.formula == row.measured.counted for row in rows if row.measured is not None]
        measured = f"line-up scenario, |A| = {ACTIONS}, |S| = {RULES}"
        lines += ["", f"Per step of the running system ({measured}):"]
        lines += ["", *align(tables["formula"], "><>>>>>>", 2), ""]
        lines += ["formula, counted: joint actions tried; ms: deciding and learning;"]
        most = max((len(row.measured.repeats) for row in rows if row.measured), default=1)
        if most > 1:
            lines += [f"[]: 95% interval of the mean of {most} repeats, each with a new team;"]
        lines += ["-: not measured, beyond a second or so a step."]
        lines += [f"All counts equal the formulas in {sum(same)} of {len(same)} rows."] * bool(same)
    if "network" in tables:
        lines += ["", "Messages of a decision, and how long it waits for them [s]:", ""]
        lines += [*align(tables["network"], "><>>>>>>", 2), ""]
        lines += ["in turn: how many follow one another, others going at once, of 1 or 10 ms each;"]
        lines += ["*: on a channel that carries one message at a time."]
        lines += ["Not counted: n (n - 1) states sent to others, to predict by (broadcast)."]
    return "\n".join(lines)


def _of_another_evaluator(rows: Sequence[CostRow]) -> list[str]:
    """Return for which rows the default evaluator does not try what the formulas count."""
    auto = AutoSettings()
    own = dict.fromkeys(row.topology for row in rows if row.free > auto.exact_up_to)
    if not own:
        return []
    return wrap(
        f"They count the evaluator exact. The default, auto, is exact up to {auto.exact_up_to} "
        f"agents (one and those below it), up to {auto.sampling_up_to} sampling if agents "
        "decide by their own value, else best-response, which try fewer joint actions: "
        f"{command_line('profile')} counts and times them. Rows: {', '.join(own)}.",
        WIDTH,
        break_on_hyphens=False,
    )


def _measured_cells(row: CostRow) -> list[str]:
    joint = None if row.formula is None else row.formula.joint_actions
    if row.measured is None:
        return [scientific(joint), *["-"] * len(MEASURED[1:])]
    step = row.measured.step
    ms = _amount(1e3 * float(step.value))
    if len(row.measured.repeats) > 1:
        ms = format_estimate(Estimate(*(1e3 * end for end in step)))
    counts = joint, *astuple(row.measured.counted)
    return [*map(scientific, counts), ms, _amount(1e-6 * row.measured.memory)]


def _amount(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if value < 1000 else f"{value:,.0f}"


def _tabular(cells: Sequence[Sequence[str]], note: str) -> str:
    head, *lines = cells
    place = head.index("topology")
    rows = [
        [cell if i == place else _latex_cell(cell) for i, cell in enumerate(line)] for line in lines
    ]
    frame = pd.DataFrame(rows, columns=head)
    columns = f"{'r' * place}l{'r' * (len(head) - place - 1)}"
    return in_latex(frame, "topology", columns, note).rstrip()


def _latex_cell(text: str) -> str:
    """Return a cell for LaTeX, numbers as they are printed."""
    if text == "-":
        return "--"
    mantissa, e, power = text.partition("e")
    if e:
        return rf"${mantissa}\times 10^{{{int(power)}}}$"
    return mantissa if "[" in mantissa else mantissa.replace(",", r"\,")


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
    below = () if text in {SINGLE_AGENT, *WAYS} else agents_below(text, n)
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
