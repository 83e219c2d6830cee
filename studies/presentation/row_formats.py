"""Rows of results written as a table to read, as CSV or as JSON.

The table is for a terminal of 80 columns: it names condition and phase once, above their rows, and
rounds. What the condition's label tells already, the swept keys, is left to CSV and JSON.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from shutil import get_terminal_size
from textwrap import wrap
from typing import Any, Literal, TextIO

from ...core.interface.measures import Measure
from .csv_text import write_csv

Format = Literal["table", "csv", "json"]

FORMATS = {"seed": "d", "episode": "d", "steps": "d", "return": ".4g"}
"""How values are shown that all scenarios have; measures see to theirs."""
HEADER = 3
"""Lines that a heading is broken into, at most."""
MISSING = "–"


@dataclass(frozen=True)
class Column:
    """A column of the table, as text.

    Attributes
    ----------
    heading
        Its heading, line by line.
    cells
        A cell for every row.
    """

    heading: tuple[str, ...]
    cells: tuple[str, ...]

    @property
    def width(self) -> int:
        """How wide it is."""
        return max(map(len, (*self.heading, *self.cells)))


def write_rows(
    names: Sequence[str],
    rows: Sequence[Sequence[Any]],
    measures: Sequence[Measure],
    form: Format,
    file: TextIO,
) -> None:
    """Write rows with their column names, some of which are those of `measures`.

    CSV and JSON hold every digit, so equal results are equal bytes. Truth values are 0 and 1 in
    CSV, true and false in JSON.
    """
    if form == "csv":
        write_csv(file, names, rows)
    elif form == "json":
        rates = {measure.name for measure in measures if measure.is_rate}
        truths = {i for i, name in enumerate(names) if name in rates}
        lines = []
        for row in rows:
            values = [bool(v) if i in truths and v is not None else v for i, v in enumerate(row)]
            lines.append(json.dumps(dict(zip(names, values, strict=True))))
        file.write("[" + ",\n ".join(lines) + "]\n")
    else:
        file.write("\n".join(_table(names, rows, measures)) + "\n")


def _table(
    names: Sequence[str], rows: Sequence[Sequence[Any]], measures: Sequence[Measure]
) -> Iterator[str]:
    """Yield the lines of the table: a header, then the rows of each condition below its label."""
    by_name = {measure.name: measure for measure in measures}
    found = {
        name: _column(name, [row[i] for row in rows], by_name.get(name))
        for i, name in enumerate(names)
        if name in FORMATS or name in by_name
    }
    width = get_terminal_size().columns
    columns, gap = _fitting(found, width)
    height = max(len(column.heading) for column in columns)
    header = [_padded(column.heading, height) for column in columns]
    cells = zip(*(head + c.cells for head, c in zip(header, columns, strict=True)), strict=True)
    widths = [column.width for column in columns]
    lines = [
        gap.join(cell.rjust(wide) for cell, wide in zip(row, widths, strict=True)).rstrip()
        for row in cells
    ]
    yield from lines[:height]
    above = [i for i, name in enumerate(names) if name in ("condition", "phase")]
    last: list[Any] = []
    for row, line in zip(rows, lines[height:], strict=True):
        here = [row[i] for i in above]
        if here != last:
            yield ""
            yield from wrap(", ".join(here), width)
            last = here
        yield line
    if hidden := [name for name, column in found.items() if column not in columns]:
        yield from ("", *wrap(f"no room for {', '.join(hidden)}: CSV and JSON have them", width))


def _column(name: str, values: Sequence[Any], measure: Measure | None) -> Column:
    """Return the column of a measure, or if it is none, of what all scenarios have."""
    form = FORMATS[name] if measure is None else _format(measure, values)
    cells = tuple(MISSING if value is None else format(value, form) for value in values)
    return Column(_broken(name if measure is None else measure.heading), cells)


def _format(measure: Measure, values: Sequence[Any]) -> str:
    """Return how values of a measure are shown: with two or three decimals, unless large."""
    if measure.is_rate:
        return "d"
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    if largest >= 1000.0:
        return ".4g"
    return ".2f" if measure.unit == "1" else ".3f"


def _broken(heading: str) -> tuple[str, ...]:
    """Return a heading broken into lines so that it is narrow, and then short.

    Examples
    --------
    >>> _broken("stopped at goal"), _broken("steps")
    (('stopped', 'at goal'), ('steps',))
    """
    words = heading.split()
    breaks = (
        cut for k in range(min(HEADER, len(words))) for cut in combinations(range(1, len(words)), k)
    )
    broken = [
        tuple(" ".join(words[a:b]) for a, b in pairwise((0, *cut, len(words)))) for cut in breaks
    ]
    return min(broken, key=lambda lines: (max(map(len, lines)), len(lines)), default=(heading,))


def _padded(heading: tuple[str, ...], height: int) -> tuple[str, ...]:
    """Return a heading of as many lines, empty ones first."""
    return ("",) * (height - len(heading)) + heading


def _fitting(columns: dict[str, Column], width: int) -> tuple[list[Column], str]:
    """Return the columns that there is room for, and the gap between them.

    If not even narrow gaps let all of them fit, the last measures are left out.
    """
    found = dict(columns)
    for gap in ("  ", " "):
        if _width(found, gap) <= width:
            return list(found.values()), gap
    for name in reversed([name for name in columns if name not in FORMATS]):
        del found[name]
        if _width(found, gap) <= width:
            break
    return list(found.values()), gap


def _width(columns: dict[str, Column], gap: str) -> int:
    return sum(column.width for column in columns.values()) + len(gap) * (len(columns) - 1)
