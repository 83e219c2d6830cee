"""Tables of costs for the terminal and as JSON, CSV and LaTeX.

Every form is made from one data frame of exact integers. A ratio beyond 2 ** 53, where
floating-point numbers cannot hold every integer, is rounded to an integer.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from textwrap import wrap
from typing import Literal

from ...core.numerics import pd
from ...core.search.enumeration import AutoSettings
from ...topologies.view import align, format_count
from ..errors import WIDTH
from ..presentation.tables import in_csv, in_latex, rows_of
from .cost import ACTIONS, PAPER, RULES, CostRow

Form = Literal["table", "json", "csv", "latex"]
VARIABLES = 7
"""Number of state variables of an agent (Section III): rules = memberships ** VARIABLES."""
QUANTITIES = ("memberships", "rules", "actions")
"""Quantities that a table may vary."""
COUNTS = ("joint_actions", "rule_evaluations", "weight_updates")
"""Counts of a step, by formula and counted."""
OF_THE_PAPER = PAPER.chain_closed_form(4)
"""Operations of four agents by Eq. 19, with the paper's |S|, |A| and L."""


Headings = Mapping[str, str]
"""Headings by column of the data frame."""

FORMULAS: Headings = {
    "nested_exact": "Eq. 18",
    "nested_closed_form": "Eq. 19",
    "nested_asymptotic": "Eq. 21",
    "single_agent": "Eq. 23",
    "ratio": "ratio",
}
SECTIONS: tuple[tuple[str, Headings, tuple[str, ...]], ...] = (
    (
        "Within a budget of joint actions that the team may try in a decision:",
        {
            "budget": "budget",
            "joint_actions": "joint actions",
            "joint_actions_tried": "tried",
            "operations": "operations",
        },
        (
            "joint actions: without the budget; tried: at most within it;",
            "operations: by Eq. 18 or 23 with the joint actions tried.",
        ),
    ),
    (
        f"Per step of the running system (line-up scenario, |A| = {ACTIONS}, |S| = {RULES}):",
        {
            "joint_actions_formula_per_step": "formula",
            "joint_actions_per_step": "counted",
            "rule_evaluations_per_step": "rules tried",
            "weight_updates_per_step": "updates",
            "decision_ms": "decide ms",
            "learning_ms": "learn ms",
        },
        (
            "formula, counted: joint actions tried;",
            "-: not measured, because a step takes more than about a second.",
        ),
    ),
    (
        "Messages of a decision:",
        {"messages": "messages", "messages_in_turn": "in turn", "broadcast": "broadcast"},
        (
            "in turn: messages that must be sent one after another;",
            "broadcast: states sent to all agents for predictions, in addition.",
        ),
    ),
)
"""Title, headings and legend of budgets, measurements and messages, which a table may have."""


def format_rows(rows: Sequence[CostRow], form: Form) -> str:
    """Return the rows in a format."""
    records = [_record(row) for row in rows]
    frame = pd.DataFrame(records, dtype=object)
    if form == "table":
        return _table(rows, frame)
    if form == "latex":
        sections = [FORMULAS, *(own for _, own, _ in SECTIONS if next(iter(own)) in frame)]
        return "\n\n".join(_tabular(headings, frame, rows) for headings in sections)
    most = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)  # those of n = 1000 are more than Python prints
    try:
        if form == "json":
            return "[" + ",\n ".join(json.dumps(record) for record in records) + "]"
        return in_csv(frame).rstrip("\n")
    finally:
        sys.set_int_max_str_digits(most)


def _record(row: CostRow) -> dict[str, object]:
    """Return a row as a record of exact integers; Eq. 21 is rounded."""
    asymptotic = row.nested_asymptotic
    ratio = row.ratio
    return {
        "agents": row.agents,
        "topology": row.topology,
        "memberships": row.memberships,
        **asdict(row.problem),
        "nested_exact": row.nested_exact,
        "nested_closed_form": row.nested_closed_form,
        "nested_asymptotic": None if asymptotic is None else round(asymptotic),
        "single_agent": row.single_agent,
        "ratio": ratio and (float(ratio) if ratio < 2**53 else round(ratio)),
        **row.extra,
    }


def _varied(frame: pd.DataFrame) -> list[str]:
    """Return the quantities with several values."""
    return [name for name in QUANTITIES if frame[name].nunique(dropna=False) > 1]


def _cells(headings: Headings, frame: pd.DataFrame) -> list[list[str]]:
    """Return the cells of a section, headings first; equal rows stand once."""
    varied = _varied(frame) if {"nested_exact", "budget"} & {*headings} else []
    varied = [name for name in varied if name != "memberships"]  # the rules say the same
    columns = [*varied, "agents", "topology", *headings]
    names = [*varied, "n", "topology", *headings.values()]
    part = frame.reindex(columns=columns).drop_duplicates()
    return [names, *([*map(_shown, row)] for row in rows_of(part))]


def _shown(value: object) -> str:
    """Return a cell rounded for reading, in scientific notation if it is large.

    >>> _shown(2457562500000), _shown(2.5), _shown(None), _shown("chain")
    ('2.458e12', '2.5', '-', 'chain')
    """
    if isinstance(value, float) and value < 1000.0:
        return f"{value:.3g}"
    if isinstance(value, int | float):
        return format_count(round(value), 10**7)
    return "-" if value is None else str(value)


def _table(rows: Sequence[CostRow], frame: pd.DataFrame) -> str:
    lines = [*_aligned(FORMULAS, frame), ""]
    for text in _legend(rows, frame):
        lines += wrap(text, WIDTH, break_on_hyphens=False)
    for title, headings, legend in SECTIONS:
        if next(iter(headings)) in frame:
            lines += ["", title, "", *_aligned(headings, frame), "", *legend]
    counted = [row.extra for row in rows if "decision_ms" in row.extra]
    same = [
        all(own[f"{name}_per_step"] == own[f"{name}_formula_per_step"] for name in COUNTS)
        for own in counted
    ]
    lines += [f"All counts equal the formulas in {sum(same)} of {len(same)} rows."] * bool(same)
    return "\n".join(lines)


def _aligned(headings: Headings, frame: pd.DataFrame) -> list[str]:
    cells = _cells(headings, frame)
    place = cells[0].index("topology")
    return align(cells, f"{'>' * place}<{'>' * len(headings)}", 1 + place)


def _constants(rows: Sequence[CostRow], frame: pd.DataFrame) -> str:
    """Return the quantities with one value, in the notation of the paper."""
    problem = rows[0].problem
    memberships = rows[0].memberships
    power = "" if memberships is None else f"{memberships}^{VARIABLES} = "
    texts = {
        "rules": f"rules |S| = {power}{problem.rules:,}",
        "actions": f"actions |A| = {problem.actions:,}",
        "iterations": f"iterations L = {problem.iterations:,}",
    }
    varied = _varied(frame)
    return ", ".join(text for name, text in texts.items() if name not in varied)


def _legend(rows: Sequence[CostRow], frame: pd.DataFrame) -> Iterator[str]:
    yield "Operations: nested by Eq. 18, chains by Eq. 19 and 21; single agent by Eq. 23."
    if "ratio" in frame:
        yield "ratio: operations of the single agent over those of the nested agents."
    constants = _constants(rows, frame)
    yield f"{constants[0].upper()}{constants[1:]}."
    if "memberships" in _varied(frame):
        numbers = " or ".join(dict.fromkeys(str(row.memberships) for row in rows))
        yield f"Rules |S| = memberships^{VARIABLES}, with {numbers} memberships."
    if any(row.agents == 4 and row.nested_closed_form == OF_THE_PAPER for row in rows):
        yield (
            "The paper prints 2.45e12 (nested) and 1.1e27 (single agent) for n = 4: it cuts "
            "2.4576e12 of Eq. 21 to three digits and rounds 1.0986e27 of Eq. 23 to two."
        )
    auto = AutoSettings()
    large = dict.fromkeys(row.topology for row in rows if row.free > auto.exact_up_to)
    if large:
        yield (
            "The formulas assume an exhaustive search (evaluator exact). If more than "
            f"{auto.exact_up_to} agents take part in a search, the default evaluator auto chooses "
            "sampling or best-response, which try fewer joint actions, in this "
            f"table for: {', '.join(large)}."
        )


def _tabular(headings: Headings, frame: pd.DataFrame, rows: Sequence[CostRow]) -> str:
    head, *lines = _cells(headings, frame)
    table = pd.DataFrame(lines, columns=head)
    for name in head:
        if name != "topology":
            table[name] = table[name].map(_latex_cell)
    place = head.index("topology")
    columns = f"{'r' * place}l{'r' * len(headings)}"
    note = f"; {_constants(rows, frame)}" if headings is FORMULAS else ""
    return in_latex(table, "topology", columns, note).rstrip()


def _latex_cell(text: str) -> str:
    """Return a number of the printed table for LaTeX."""
    if text == "-":
        return "--"
    mantissa, e, power = text.partition("e")
    if e:
        return rf"${mantissa}\times 10^{{{int(power)}}}$"
    return mantissa.replace(",", r"\,")
