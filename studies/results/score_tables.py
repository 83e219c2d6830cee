"""Tables of scores as text: CSV, JSON lines, JSON, Parquet and frames of pandas.

Names stay as they are written: 3.1 and 3.10, 0012 and 12, "None" and a blank cell differ. Only
scores become numbers. Every message names the line or row of the file.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.numerics import IntArray, pd
from ...core.plugins.words import show
from ..errors import SpecError, refused
from ..store.durable import check_file, read_text
from ..trials.episodes import MAX_NUMBER
from .json_files import Json, read_json

SUFFIXES = (".csv", ".jsonl", ".parquet")
"""Suffixes of files that can only be tables."""
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""A decimal number with a point."""
TRUTHS = {"true": 1.0, "false": 0.0}
"""Scores that are truth values."""
SEPARATORS = {";": "semicolons", "\t": "tabs"}
"""Separators of fields that are not supported."""


class JsonNumber(str):
    """A number of a JSON file with all its written digits."""

    __slots__ = ()


class ScoreTable(NamedTuple):
    """A table with the unconverted cells of its file or frame."""

    frame: pd.DataFrame
    """Cells by column name; rows are numbered from 0."""
    places: Sequence[str]
    """Line of the file, or label of the row, of each row."""

    @classmethod
    def of(
        cls, rows: object, places: Iterable[object], unit: str = "row", **names: object
    ) -> ScoreTable:
        """Return the table of rows with cells of any type."""
        frame = pd.DataFrame(rows, dtype=object, **names)
        return cls(frame, [f"{unit} {place}" for place in places])

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self.frame.columns)

    def refuse(self, is_wrong: ArrayLike, column: str, problem: str) -> None:
        """Raise `SpecError` with the first wrong cell of a column, if there is one."""
        rows = np.flatnonzero(is_wrong)
        if len(rows):
            cell = self.frame[column].iloc[rows[0]]
            shown = "is blank" if is_blank(cell) else f"= {show(cell)}"
            raise SpecError(f"{self.places[rows[0]]}: {column} {shown}{problem}")

    def take(self, rows: IntArray) -> ScoreTable:
        """Return some rows of the table."""
        places = [self.places[row] for row in rows]
        return ScoreTable(self.frame.iloc[rows].reset_index(drop=True), places)

    def text(self, column: str) -> pd.Series:
        """Return a column of names as text; blank cells are empty.

        Raises
        ------
        SpecError
            If a cell is no name, or a number and a text are spelled alike.
        """
        cells = self.frame[column]
        texts = cells.map(cell_text)
        self.refuse(texts.isna(), column, ": must be text or a number")
        exact = ": is a rounded number; whole numbers of this size must be integers or text"
        self.refuse(cells.map(_is_rounded), column, exact)
        is_text = cells.map(lambda cell: isinstance(cell, str) and not isinstance(cell, JsonNumber))
        is_other = is_text != is_text.groupby(texts).transform("first")
        other = ": must be text everywhere or a number everywhere"
        self.refuse(is_other & (texts != ""), column, other)
        return texts

    def names(self, column: str) -> pd.Series:
        """Return a column of names as `text` does, none of which may be blank."""
        texts = self.text(column)
        self.refuse(texts == "", column, "")
        return texts

    def numbers(self, column: str) -> pd.Series:
        """Return a column of scores as numbers; true is 1, blank cells are not a number.

        Raises
        ------
        SpecError
            If a score is no finite number, or truth values stand among other numbers.
        """
        values = self.frame[column].map(score_value).astype(float)
        finite = ": must be a finite number with a decimal point, at most 1e100, or blank"
        self.refuse(values.abs() > MAX_NUMBER, column, finite)
        if not values.dropna().isin((0.0, 1.0)).all():
            truths = self.frame[column].map(cell_text).str.strip().str.lower().isin(TRUTHS)
            self.refuse(truths, column, ": must be a number, as other scores are")
        return values


def is_blank(cell: object) -> bool:
    """Return whether a cell is blank."""
    if isinstance(cell, str):
        return not cell.strip()
    return cell is None or (pd.api.types.is_scalar(cell) and bool(pd.isna(cell)))


def _is_rounded(cell: object) -> bool:
    """Return whether a cell is a float of a size at which floats skip whole numbers."""
    return isinstance(cell, float | np.floating) and bool(np.spacing(np.abs(cell)) > 1.0)


def cell_text(cell: object) -> str | None:
    """Return a cell as text, empty if it is blank; None if it is a list, a table or bytes.

    Examples
    --------
    >>> [cell_text(cell) for cell in ("0012", 12, 3.1, True, None, [1])]
    ['0012', '12', '3.1', 'true', '', None]
    """
    if is_blank(cell):
        return ""
    if isinstance(cell, bool | np.bool_):
        return str(bool(cell)).lower()
    is_name = pd.api.types.is_scalar(cell) and not isinstance(cell, bytes)
    return str(cell) if is_name else None


def score_value(cell: object) -> float:
    """Return a score, not a number if it is blank, infinite if it is no finite number.

    Examples
    --------
    >>> [score_value(cell) for cell in ("0.5", "1e3", True, "false", None, "0,5", "nan")]
    [0.5, 1000.0, 1.0, 0.0, nan, inf, inf]
    """
    text = cell_text(cell)
    if text is None:
        return np.inf
    text = text.strip()
    if NUMBER.fullmatch(text):
        return float(text)
    return TRUTHS.get(text.lower(), np.inf) if text else np.nan


def read_table(path: Path) -> ScoreTable:
    """Read a table by the suffix of its file: ``.csv``, ``.jsonl``, ``.parquet``, else JSON.

    Raises
    ------
    SpecError
        If the file holds no table; one line names the file and the line of the file.
    """
    try:
        if path.suffix == ".csv":
            return _read_csv(read_text(path))
        if path.suffix == ".jsonl":
            return _read_json_lines(read_text(path))
        if path.suffix == ".parquet":
            check_file(path)
            exact = {"dtype_backend": "pyarrow"}  # whole numbers beside blank cells stay whole
            frame = pd.read_parquet(
                path, engine="pyarrow", page_checksum_verification=True, **exact
            )
            return table_of(frame)
        records = read_json(read_text(path), JsonNumber)
        if not isinstance(records, list) or {*map(type, records)} != {dict}:
            raise ValueError("must be a list of objects, [{...}, ...]")
        return ScoreTable.of(records, range(len(records)))
    except ImportError:
        raise SpecError(f"{path}: Parquet is read by pyarrow: pip install pyarrow") from None
    except FileNotFoundError:
        raise SpecError(f"{path}: no such file") from None
    except SpecError as error:
        raise SpecError(f"{path}: {error}") from None
    except (OSError, ValueError, TypeError, LookupError, RecursionError) as error:
        line = str(error).partition("\n")[0]
        raise SpecError(f"{path}: holds no table of scores: {line}") from None


def table_of(frame: pd.DataFrame) -> ScoreTable:
    """Return the table of a frame of pandas; levels of its index that have a name are columns.

    Raises
    ------
    SpecError
        If two columns have the same name.
    """
    levels = [name for name in frame.index.names if name is not None and name not in frame.columns]
    whole = frame.reset_index(level=levels) if levels else frame
    whole = whole.set_axis([str(name) for name in whole.columns], axis=1)
    _refuse_equal_names(list(whole.columns))
    return ScoreTable.of(whole.reset_index(drop=True), whole.index)


def _refuse_equal_names(names: Sequence[str]) -> None:
    for name in names:
        if name and names.count(name) > 1:
            raise SpecError(f"column {name!r}: stands twice")


def _read_csv(text: str) -> ScoreTable:
    """Return the table of a CSV file; every row must have as many fields as the header."""
    reader = csv.reader(StringIO(text, newline=""), strict=True)
    rows: dict[int, list[str]] = {}
    line = 1
    try:
        for row in reader:
            if row:
                rows[line] = row
            line = reader.line_num + 1
    except csv.Error as error:
        raise SpecError(f"line {line}: {error}") from None
    if not rows:
        raise ValueError("no columns")
    line, header = next(iter(rows.items()))
    for separator, name in SEPARATORS.items():
        if len(header) == 1 and separator in header[0]:
            raise SpecError(f"line {line}: fields are separated by {name}, allowed: commas")
    with refused(f"line {line}: "):
        _refuse_equal_names(header)
    for line, row in rows.items():
        if len(row) != len(header):
            last = header[min(len(row), len(header)) - 1]
            raise SpecError(
                f"line {line}: has {len(row)} fields, the header has {len(header)} "
                f"(last common column {last!r})"
            )
    return ScoreTable.of([*rows.values()][1:], [*rows][1:], "line", columns=header)


def _read_json_lines(text: str) -> ScoreTable:
    """Return the table of JSON lines; only a line feed ends a line."""
    rows: dict[int, dict[str, Json]] = {}
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            with refused(f"line {number}: "):
                row = read_json(line, JsonNumber)
                if not isinstance(row, dict):
                    raise ValueError("must be an object, {...}")
            rows[number] = row
    return ScoreTable.of([*rows.values()], rows, "line")
