"""Rows of results written as a table to read, as CSV or as JSON.

The table is for a terminal: it names condition and phase once, above their rows, and rounds. What
the condition's label says already, the swept keys, is left to CSV and JSON.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from shutil import get_terminal_size
from typing import Any, Literal, TextIO

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ...core.interface.measures import Measure
from ...core.plugins.deferred import pd
from .csv_text import rows_of, write_frame

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
        write_frame(file, frame)
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
