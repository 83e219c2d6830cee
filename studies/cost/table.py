"""Tables of costs, for the terminal and as JSON, CSV and LaTeX.

Integers keep every digit in the files. A ratio beyond 2 ** 53, where floating-point numbers lie
farther apart, is rounded to an integer.
"""

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, astuple, dataclass
from fractions import Fraction
from html import escape
from itertools import product
from numbers import Integral
from textwrap import wrap
from typing import Literal

from ...core.agents.cost import Problem, is_chain
from ...core.evaluators.enumeration import AutoSettings
from ...core.numerics import pd
from ...core.plugins.words import expect, expect_each
from ...core.shell import command_line
from ...topologies.view import align, format_count
from ..errors import WIDTH
from ..presentation.tables import in_csv, in_latex
from ..results.notation import format_estimate
from ..results.statistics import Estimate
from .cost import (
    LABELLED,
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
FORMULAS = ("Eq. 18", "Eq. 19", "Eq. 21", "single agent", "ratio")
"""Headings of `CostRow.by_formula`."""
MEASURED = ("formula", "counted", "rules valued", "updates", "ms", "MB")
"""Headings of what was measured per step."""
NETWORK = ("messages", "in turn", "1 ms", "10 ms", "1 ms*", "10 ms*")
"""Headings of messages, and of the seconds that a decision waits for them."""
OF_THE_PAPER = PAPER.chain_closed_form(4)
"""Operations of four agents by Eq. 19, with the paper's |S|, |A| and L."""


def format_rows(rows: Sequence[CostRow], form: Form) -> str:
    """Return the rows in a format."""
    if form == "table":
        return _table(rows)
    if form == "latex":
        return "\n\n".join(map(_tabular, _cells(rows).values()))
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


def _cells(rows: Sequence[CostRow]) -> dict[str, list[list[str]]]:
    """Return the cells of each table, headings first: formulas, then what of rows was asked for."""
    tables = {"topology": _with_headings(FORMULAS, rows, _formula_cells)}
    if any(row.formula is not None for row in rows):
        tables["formula"] = _with_headings(MEASURED, rows, _measured_cells)
    if any(row.network is not None for row in rows):
        tables["network"] = _with_headings(NETWORK, rows, _network_cells)
    return tables


def _with_headings(
    titles: Sequence[str], rows: Sequence[CostRow], cells: Callable[[CostRow], list[str]]
) -> list[list[str]]:
    lines = [[str(row.agents), row.topology, *cells(row)] for row in rows]
    return [["n", "topology", *titles], *lines]


def _formula_cells(row: CostRow) -> list[str]:
    return [scientific(value) for value in row.by_formula.values()]


def _network_cells(row: CostRow) -> list[str]:
    assert row.network is not None
    waits = (_amount(1e-3 * ms * count) for count in reversed(row.network) for ms in (1, 10))
    return [*(f"{count:,}" for count in row.network), *waits]


def _table(rows: Sequence[CostRow]) -> str:
    tables = _cells(rows)
    lines = [*align(tables["topology"], "><>>>>>", 2), ""]
    lines.append("Operations: nested by Eq. 18, chains by Eq. 19 and 21; single agent by Eq. 23.")
    if any(row.agents == 4 and row.nested_closed_form == OF_THE_PAPER for row in rows):
        lines.append("The paper prints 2.45e12 (nested) and 1.1e27 (single agent) for n = 4.")
    lines += _of_another_evaluator(rows)
    if "formula" in tables:
        same = [row.formula == row.measured.counted for row in rows if row.measured is not None]
        lines += ["", f"Per step of the running system (line-up scenario, |A| = 4, |S| = {RULES}):"]
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


def _tabular(cells: Sequence[Sequence[str]]) -> str:
    head, *lines = cells
    rows = [(n, topology, *map(_latex_cell, numbers)) for n, topology, *numbers in lines]
    frame = pd.DataFrame(rows, columns=head)
    return in_latex(frame, "topology", f"rl{'r' * (len(head) - 2)}").rstrip()


def _latex_cell(text: str) -> str:
    """Return a cell for LaTeX, numbers as they are printed."""
    if text == "-":
        return "--"
    mantissa, e, power = text.partition("e")
    if e:
        return rf"${mantissa}\times 10^{{{int(power)}}}$"
    return mantissa if "[" in mantissa else mantissa.replace(",", r"\,")


MOST_REPEATS = 1000
"""A repeat takes a third of a second or more."""


@dataclass(frozen=True)
class CostTable:
    """Costs, a row for every topology and number of agents; printed or shown by a notebook."""

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


def cost_table(
    topologies: Sequence[str] = ("chain",),
    agents: Iterable[int] = (4,),
    problem: Problem = PAPER,
    *,
    measured: bool = False,
    repeats: int = 1,
    network: bool = False,
) -> CostTable:
    """Return what hierarchies cost, by Eq. 18-23 and, if asked, measured.

    Parameters
    ----------
    topologies
        As in a spec, or ``label=topology`` with a label of one's own; ``single-agent``, or ways to
        decide: ``best-response``, ``max-plus``, ``fitted-q``, ``hierarchy-ppo``.
    agents
        Numbers of agents.
    problem
        Rules and actions of an agent, and steps of an episode; those of the paper unless given.
    measured
        Whether to count and time steps of the running system, too.
    repeats
        How often steps are timed, each with a new team; from two on the time has an interval.
    network
        Whether to count the messages of a decision, and how many of them follow one another.

    Raises
    ------
    ValueError
        If there is no topology, one or a number is refused, or two have one label; one line.
    """
    expect("names of topologies", Sequence | None, topologies=topologies)
    expect("numbers of agents", Iterable, agents=agents)
    numbers = list(agents)
    expect_each("names of topologies", str, topologies=topologies)
    expect_each("numbers of agents", Integral, agents=numbers)
    expect("a Problem", Problem, problem=problem)
    if not 1 <= repeats <= MOST_REPEATS:
        raise ValueError(f"repeats = {repeats}, allowed: 1 to {MOST_REPEATS}")
    if not topologies:
        raise ValueError("topology = none, allowed: one or more, such as chain or tree:2")
    matches = [LABELLED.fullmatch(text) for text in topologies]
    named = [m.groups() if m else (t, t) for m, t in zip(matches, topologies, strict=True)]
    labels = [label for label, _ in named]
    rows = []
    for (label, text), n in product(named, numbers):
        if labels.count(label) > 1:
            raise ValueError(f"topology = {label!r} more than once; name each: LABEL={text}")
        below = () if text in {SINGLE_AGENT, *WAYS} else agents_below(text, n)
        is_one = bool(below) and is_chain(below)
        tried = None if text == SINGLE_AGENT else joint_actions(text, n, problem.actions)
        row = CostRow(
            agents=n,
            topology=label,
            nested_exact=None if tried is None else problem.sweep(tried),
            nested_closed_form=problem.chain_closed_form(n) if is_one else None,
            nested_asymptotic=problem.chain_asymptotic(n) if is_one else None,
            free=1 + max(below, default=-1),
            single_agent=problem.single_agent(n),
            formula=step_formula(text, n) if measured else None,
            measured=measure(text, n, repeats) if measured else None,
            network=messages(text, n) if network else None,
            broadcast=broadcasts(text, n) if network else 0,
        )
        rows.append(row)
    return CostTable(tuple(rows))
