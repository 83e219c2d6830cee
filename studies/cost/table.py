"""Tables of cost: for the terminal, as JSON, CSV and LaTeX. Integers keep every digit in the files.

A ratio is written as an integer where it is one or no floating-point number holds it.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, Literal

from ...topologies.view import aligned, readable
from ..presentation.csv_text import write_csv
from ..presentation.tables import escaped, tabular
from .cost import PAPER, RULES, CostRow, StepCost

Form = Literal["table", "json", "csv", "latex"]

FORMULAS = (
    ("nested_exact", "Eq. 18"),
    ("nested_closed_form", "Eq. 19"),
    ("nested_asymptotic", "Eq. 21"),
    ("single_agent", "single agent"),
    ("ratio", "ratio"),
)
"""Columns by name, with their heading."""
MEASURED = ("formula", "counted", "rules valued", "updates", "ms", "MB")
"""Headings of what was measured per step."""
PRINTED = ("2.45e12", "1.1e27")
"""Operations of four agents as the paper prints them (Section VIII)."""
OF_THE_PAPER = PAPER.chain_closed_form(4)
"""The same by Eq. 19, with the paper's |S|, |A| and L."""
COUNTS = ("joint_actions", "rule_evaluations", "weight_updates")


def written(rows: Sequence[CostRow], form: Form) -> str:
    """Return the rows in a format."""
    if form == "table":
        return _table(rows)
    if form == "latex":
        return _latex(rows)
    records = [_record(row) for row in rows]
    with _all_digits():
        if form == "json":
            return "[" + ",\n ".join(json.dumps(record) for record in records) + "]"
        file = io.StringIO()
        columns = list(dict.fromkeys(name for record in records for name in record))
        write_csv(file, columns, [[record.get(name) for name in columns] for record in records])
        return file.getvalue().rstrip("\n")


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
    return readable(round(value), 10**7)


def _record(row: CostRow) -> dict[str, Any]:
    """Return a row with integers as integers; Eq. 21 is rounded to the nearest one."""
    asymptotic = row.nested_asymptotic
    record = {name: getattr(row, name) for name in ("agents", "topology", *dict(FORMULAS))}
    record["nested_asymptotic"] = None if asymptotic is None else round(asymptotic)
    record["ratio"] = _ratio(row.ratio)
    if row.measured is None:
        return record
    for count in COUNTS:
        record[f"{count}_formula_per_step"] = getattr(row.measured.formula, count)
        record[f"{count}_per_step"] = getattr(row.measured.counted, count)
    record["deciding_s"] = row.measured.deciding
    record["learning_s"] = row.measured.learning
    record["memory_bytes"] = row.measured.memory
    return record


def _ratio(ratio: Fraction | None) -> int | float | None:
    if ratio is None:
        return None
    if ratio.denominator == 1 or ratio > sys.float_info.max:
        return round(ratio)
    return float(ratio)


@contextmanager
def _all_digits() -> Iterator[None]:
    """Let Python print integers of more than 4300 digits, which n = 1000 needs."""
    most = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        yield
    finally:
        sys.set_int_max_str_digits(most)


def _table(rows: Sequence[CostRow]) -> str:
    cells = [["n", "topology", *(title for _, title in FORMULAS)]]
    for row in rows:
        values = (scientific(getattr(row, name)) for name, _ in FORMULAS)
        cells.append([str(row.agents), row.topology, *values])
    lines = [*aligned(cells, "><>>>>>"), ""]
    lines.append("Operations: nested by Eq. 18, chains by Eq. 19 and 21; single agent by Eq. 23.")
    if any(row.agents == 4 and row.nested_closed_form == OF_THE_PAPER for row in rows):
        nested, single = PRINTED
        lines.append(f"The paper prints {nested} (nested) and {single} (single agent) for n = 4.")
    if any(row.measured is not None for row in rows):
        lines += ["", *_measured(rows)]
    return "\n".join(lines)


def _measured(rows: Sequence[CostRow]) -> list[str]:
    cells = [["n", "topology", *MEASURED]]
    cells += [[str(row.agents), row.topology, *_measured_cells(row.measured)] for row in rows]
    measured = [row.measured for row in rows if row.measured is not None]
    agreeing = sum(m.formula == m.counted for m in measured)
    lines = [f"Per step of the running system (line-up scenario, |A| = 4, |S| = {RULES}):", ""]
    lines += [*aligned(cells, "><>>>>>>"), ""]
    lines += ["formula, counted: joint actions tried; ms: deciding and learning;"]
    lines += ["-: beyond a second or so a step."]
    lines += [f"All counts equal the formulas in {agreeing} of {len(measured)} rows."]
    return lines


def _measured_cells(measured: StepCost | None) -> list[str]:
    if measured is None:
        return ["-"] * len(MEASURED)
    c = measured.counted
    counts = measured.formula.joint_actions, c.joint_actions, c.rule_evaluations, c.weight_updates
    amounts = (1e3 * (measured.deciding + measured.learning), 1e-6 * measured.memory)
    return [*map(scientific, counts), *(f"{a:.3g}" if a < 1000 else f"{a:,.0f}" for a in amounts)]


def _latex(rows: Sequence[CostRow]) -> str:
    """Return a tabular of the formulas and, if anything was measured, a second one of that."""
    titles = ["nested (18)", "closed form (19)", "asymptotic (21)", "single agent (23)", "ratio"]
    formulas = [[scientific(getattr(row, name)) for name, _ in FORMULAS] for row in rows]
    tables = [_tabular(rows, titles, formulas)]
    if any(row.measured is not None for row in rows):
        cells = [_measured_cells(row.measured) for row in rows]
        tables.append(_tabular(rows, MEASURED, cells))
    return "\n\n".join(tables)


def _tabular(rows: Sequence[CostRow], titles: Sequence[str], cells: Sequence[Sequence[str]]) -> str:
    lines = [["$n$", "topology", *titles]]
    for row, values in zip(rows, cells, strict=True):
        topology = escaped(row.topology).replace(">", "$>$")
        lines.append([str(row.agents), topology, *map(_latex_cell, values)])
    return tabular("{booktabs}", f"{{rl{'r' * len(titles)}}}", lines)


def _latex_cell(text: str) -> str:
    """Return a number as it is printed, for LaTeX."""
    if text == "-":
        return "--"
    mantissa, e, power = text.partition("e")
    return rf"${mantissa}\times 10^{{{int(power)}}}$" if e else mantissa.replace(",", r"\,")
