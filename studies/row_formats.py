"""Rows of results written as a table to read, as CSV or as JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from typing import Any, Literal, TextIO

Format = Literal["table", "csv", "json"]
TRUTHS = ("success", "stopped_at_goal")


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
        cells = [[*names], *([_short(value) for value in row] for row in rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        for row in cells:
            line = "  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True))
            file.write(line.rstrip() + "\n")


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
