"""CSV that is harmless in a spreadsheet.

Spreadsheets take a cell that begins with ``=``, ``+``, ``-`` or ``@`` for a formula, and a formula
can send away what stands beside it. Labels and names of a study may come from anybody: a text that
begins so, and is no number, gets an apostrophe in front. Numbers stay numbers.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TextIO

from ...core.plugins.deferred import pd

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""With what a spreadsheet's formula begins, if the spaces before it are left out."""


def write_csv(file: TextIO, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows; None becomes an empty cell."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(map(harmless, names))
    writer.writerows(map(harmless, row) for row in rows)


def write_frame(file: TextIO, frame: pd.DataFrame) -> None:
    """Write a frame with a header; truth values are 0 and 1, what is missing is an empty cell."""
    write_csv(file, list(frame.columns), rows_of(frame))


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
