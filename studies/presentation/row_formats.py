"""Rows of results written as a table to read, as CSV or as JSON.

The table is for a terminal of 80 columns: it names condition and phase once, above their rows, and
rounds. What the condition's label tells already, the swept keys, is left to CSV and JSON.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from shutil import get_terminal_size
from textwrap import wrap
from typing import Any, Literal, TextIO

Format = Literal["table", "csv", "json"]
TRUTHS = ("success", "stopped_at_goal")

TITLES: dict[str, tuple[str, str, str]] = {
    "seed": ("", "seed", "d"),
    "episode": ("", "episode", "d"),
    "steps": ("", "steps", "d"),
    "success": ("", "success", "d"),
    "stopped_at_goal": ("stopped", "at goal", "d"),
    "final_distance_m": ("distance", "[m]", ".3f"),
    "final_orientation_rad": ("angle", "[rad]", ".3f"),
    "contact_fraction": ("contact", "[0-1]", ".2f"),
    "return": ("", "return", ".4g"),
}
"""The columns of the table: two lines of header, and the format of a value."""


def write_rows(
    names: Sequence[str], rows: Sequence[Sequence[Any]], form: Format, file: TextIO
) -> None:
    """Write rows with their column names.

    CSV and JSON hold every digit, so equal results are equal bytes. Truth values are 0 and 1 in
    CSV, true and false in JSON.
    """
    if form == "csv":
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)
    elif form == "json":
        truths = [i for i, name in enumerate(names) if name in TRUTHS]
        lines = []
        for row in rows:
            values = [bool(v) if i in truths else v for i, v in enumerate(row)]
            lines.append(json.dumps(dict(zip(names, values, strict=True))))
        file.write("[" + ",\n ".join(lines) + "]\n")
    else:
        file.write("\n".join(_table(names, rows)) + "\n")


def _table(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> Iterator[str]:
    """Yield the lines of the table: a header, then the rows of each condition below its label."""
    shown = [(i, *TITLES[name]) for i, name in enumerate(names) if name in TITLES]
    above = [i for i, name in enumerate(names) if name in ("condition", "phase")]
    header = [[upper for _, upper, _, _ in shown], [lower for _, _, lower, _ in shown]]
    cells = [[format(row[i], form) for i, _, _, form in shown] for row in rows]
    widths = [max(map(len, column)) for column in zip(*header, *cells, strict=True)]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in header + cells
    ]
    yield from (line for line in lines[:2] if line)
    last: list[Any] = []
    for row, line in zip(rows, lines[2:], strict=True):
        here = [row[i] for i in above]
        if here != last:
            yield ""
            yield from wrap(", ".join(here), get_terminal_size().columns)
            last = here
        yield line
