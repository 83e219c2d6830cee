"""Rows of results written as a table to read, as CSV or as JSON.

The table is for a terminal: it names condition and phase once, above their rows, and rounds. What
the condition's label says already, the swept keys, is left to CSV and JSON.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from shutil import get_terminal_size
from typing import Any, Literal, TextIO

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ...core.interface.scenario import Measure
from ...core.numerics import pd

Format = Literal["table", "csv", "json"]

FORMATS = {"seed": "d", "episode": "d", "steps": "d", "return": ".4g"}
"""How values are shown that all scenarios have; measures see to theirs."""
MISSING = "–"


def write_rows(
    frame: pd.DataFrame, measures: Sequence[Measure], form: Format, file: TextIO
) -> None:
    """Write a frame of episodes, some of whose columns are those of `measures`.

    CSV and JSON hold every digit, so equal results are equal bytes. Truth values are 0 and 1 in
    CSV, true and false in JSON.
    """
    if form == "csv":
        file.write(in_csv(frame))
    elif form == "json":
        names = list(frame.columns)
        lines = [json.dumps(dict(zip(names, row, strict=True))) for row in rows_of(frame)]
        file.write("[" + ",\n ".join(lines) + "]\n")
    else:
        text = io.StringIO()  # a console would end the program when its reader goes away
        console = Console(file=text, width=get_terminal_size().columns, highlight=False)
        for (condition, phase), rows in frame.groupby(["condition", "phase"], sort=False):
            console.print(f"\n{escape(condition)}, {escape(phase)}")
            console.print(_table(rows, {m.name: m for m in measures}))
        file.write(text.getvalue())


def _table(frame: pd.DataFrame, measures: dict[str, Measure]) -> Table:
    """Return the rows of one condition; no word and no number is broken if there is any room."""
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="")
    shown = [name for name in frame.columns if name in FORMATS or name in measures]
    cells = [_cells(frame[[name]], measures.get(name)) for name in shown]
    for name, texts in zip(shown, cells, strict=True):
        heading = measures[name].heading if name in measures else name
        least = max(map(len, [*heading.split(), *texts]))
        table.add_column(escape(heading), justify="right", vertical="bottom", min_width=least)
    for row in zip(*cells, strict=True):
        table.add_row(*row)
    return table


def _cells(column: pd.DataFrame, measure: Measure | None) -> list[str]:
    """Return the values of a column as text."""
    values = [value for (value,) in rows_of(column)]
    form = FORMATS[column.columns[0]] if measure is None else _format(measure, values)
    return [MISSING if value is None else format(value, form) for value in values]


def _format(measure: Measure, values: Sequence[Any]) -> str:
    """Return how values of a measure are shown: with two or three decimals, unless large."""
    if measure.is_rate:
        return "d"
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    if largest >= 1000.0:
        return ".4g"
    return ".2f" if measure.unit == "1" else ".3f"


FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""With what a spreadsheet's formula begins, if the spaces before it are left out."""


def write_csv(file: TextIO, names: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows; None becomes an empty cell."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(map(harmless, names))
    writer.writerows(map(harmless, row) for row in rows)


def in_csv(frame: pd.DataFrame) -> str:
    """Return a frame with a header; truth values are 0 and 1, what is missing is an empty cell."""
    file = io.StringIO()
    write_csv(file, frame.columns, rows_of(frame))
    return file.getvalue()


def rows_of(frame: pd.DataFrame) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of a frame as values of Python's own types; None is what is missing."""
    values: Any = frame.astype(object).where(frame.notna(), None)
    yield from values.itertuples(index=False, name=None)


def harmless(value: Any) -> Any:
    """Return a value as it may stand in a spreadsheet, a truth value as 0 or 1.

    Examples
    --------
    >>> [harmless(value) for value in ("=1+1", "@SUM(A1)", "-0.5", -0.5, "chain", None)]
    ["'=1+1", "'@SUM(A1)", '-0.5', -0.5, 'chain', None]
    """
    if isinstance(value, bool):
        return int(value)
    if not isinstance(value, str) or not value.lstrip(" \n").startswith(FORMULA):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
