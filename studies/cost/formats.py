"""Tables of costs for the terminal and as JSON, CSV and LaTeX.

Integers keep every digit in the files. A ratio beyond 2 ** 53, where floating-point numbers cannot
hold every integer, is rounded to an integer.
"""

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, astuple
from fractions import Fraction
from textwrap import wrap
from typing import Literal

from ...core.numerics import pd
from ...core.search.enumeration import AutoSettings
from ...topologies.view import align, format_count
from ..errors import WIDTH
from ..presentation.tables import in_csv, in_latex
from ..results.notation import format_estimate
from ..results.statistics import Estimate
from .cost import (
    ACTIONS,
    PAPER,
    RULES,
    CostRow,
    StepCost,
)

Form = Literal["table", "json", "csv", "latex"]
VARIABLES = 7
"""Number of state variables of an agent (Section III): rules = memberships ** VARIABLES."""
QUANTITIES: dict[str, Callable[[CostRow], int | None]] = {
    "memberships": lambda row: row.memberships,
    "rules": lambda row: row.problem.rules,
    "actions": lambda row: row.problem.actions,
}
"""Quantities that a table may vary: heading and value in a row."""
FORMULAS = ("Eq. 18", "Eq. 19", "Eq. 21", "single agent", "ratio")
"""Headings of `CostRow.by_formula`."""
MEASURED = ("formula", "counted", "rules valued", "updates", "ms", "MB")
"""Headings of the columns for measured steps."""
NETWORK = ("messages", "in turn", "1 ms", "10 ms", "1 ms*", "10 ms*")
"""Headings of the columns for messages and waiting times [s]."""
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
    """Return a number rounded for reading, in scientific notation if it is large.

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
    """Return a row as a record of exact integers; Eq. 21 is rounded."""
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
    """Return the quantities with several values."""
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
    """Return the quantities with one value, in the notation of the paper."""
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
        lines += ["formula, counted: joint actions tried; ms: decision and learning;"]
        most = max((len(row.measured.repeats) for row in rows if row.measured), default=1)
        if most > 1:
            lines += [f"[]: 95% interval of the mean of {most} repeats, each with a new team;"]
        lines += ["-: not measured, because a step takes more than about a second."]
        lines += [f"All counts equal the formulas in {sum(same)} of {len(same)} rows."] * bool(same)
    if "network" in tables:
        lines += ["", "Messages of a decision, and waiting times [s]:", ""]
        lines += [*align(tables["network"], "><>>>>>>", 2), ""]
        lines += ["in turn: messages that must be sent one after another, 1 or 10 ms each;"]
        lines += ["*: all messages on a channel that carries one at a time."]
        lines += ["Not counted: n (n - 1) states broadcast for predictions."]
    return "\n".join(lines)


def _of_another_evaluator(rows: Sequence[CostRow]) -> list[str]:
    """Return a remark on rows for which the default evaluator tries fewer joint actions."""
    auto = AutoSettings()
    own = dict.fromkeys(row.topology for row in rows if row.free > auto.exact_up_to)
    if not own:
        return []
    return wrap(
        "The formulas count the evaluator exact. For more than "
        f"{auto.exact_up_to} agents (one and those below it), the default evaluator auto chooses "
        "sampling or best-response, which try fewer joint actions. "
        f"Rows: {', '.join(own)}.",
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
