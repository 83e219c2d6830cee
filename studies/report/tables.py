"""The table of a study for reading, as CSV with every digit, and as LaTeX."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..statistics import Estimate
from ..summary import Summary, interval, number

LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
}  # fmt: skip
"""What LaTeX reads otherwise, and how it is written instead."""


@dataclass(frozen=True)
class Cell:
    """An estimate as text: its value, and its interval or nothing."""

    value: str
    interval: str


@dataclass(frozen=True)
class Table:
    """A table in its three forms.

    Attributes
    ----------
    titles
        Headings of the estimates.
    rows
        Condition, number of seeds, and a cell per title; none where there is no estimate.
    csv, latex
        The whole table as text.
    """

    titles: tuple[str, ...]
    rows: tuple[tuple[str, int, tuple[Cell | None, ...]], ...]
    csv: str
    latex: str


def tabulate(lines: Sequence[Summary]) -> Table:
    """Return the table of some summaries, whose estimates may differ in their titles."""
    titles = tuple(dict.fromkeys(title for line in lines for title in line.estimates))
    rows = tuple(
        (s.condition, s.seeds, tuple(_cell(s.estimates.get(title)) for title in titles))
        for s in lines
    )
    return Table(titles, rows, _csv(lines, titles), _latex(titles, rows))


def _cell(estimate: Estimate | None) -> Cell | None:
    if estimate is None:
        return None
    known = not np.isnan(estimate.low)
    return Cell(number(float(estimate.value)), interval(estimate) if known else "")


def _csv(lines: Sequence[Summary], titles: Sequence[str]) -> str:
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    ends = [f"{title}{end}" for title in titles for end in ("", " low", " high")]
    writer.writerow(["condition", "seeds", *ends])
    for line in lines:
        values: list[object] = [line.condition, line.seeds]
        for title in titles:
            estimate = line.estimates.get(title)
            numbers = (np.nan,) * 3 if estimate is None else _ends(estimate)
            values += ["" if np.isnan(value) else repr(value) for value in numbers]
        writer.writerow(values)
    return file.getvalue()


def _ends(estimate: Estimate) -> tuple[float, float, float]:
    return float(estimate.value), float(estimate.low), float(estimate.high)


def _latex(titles: Sequence[str], rows: Sequence[tuple[str, int, tuple[Cell | None, ...]]]) -> str:
    lines = [
        "% needs \\usepackage{booktabs}; 95 % intervals in brackets",
        rf"\begin{{tabular}}{{lr{'r' * len(titles)}}}",
        r"\toprule",
        " & ".join(["condition", "seeds", *map(_escaped, titles)]) + r" \\",
        r"\midrule",
    ]
    for condition, seeds, cells in rows:
        # After a line's end LaTeX would take a leading bracket for an option.
        name = "{}" * condition.startswith(("[", "*")) + _escaped(condition)
        lines.append(" & ".join([name, str(seeds), *map(_maths, cells)]) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _maths(cell: Cell | None) -> str:
    if cell is None:
        return "--"
    around = rf"\;[{cell.interval.replace('–', ', ')}]" if cell.interval else ""
    return f"${cell.value}{around}$"


def _escaped(text: str) -> str:
    return "".join(LATEX.get(character, character) for character in text)
