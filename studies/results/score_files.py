"""Tables of scores as text: CSV, JSON lines, JSON, Parquet and frames of pandas.

Names stay as they are written: 3.1 and 3.10, 0012 and 12, "None" and a blank cell differ. Only
scores become numbers. Every message names the line or row of the file.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.numerics import pd
from ...core.plugins.words import show
from ..errors import SpecError
from ..store.durable import check_file, read_text
from .json_values import read_json

SUFFIXES = (".csv", ".jsonl", ".parquet")
"""Suffixes of files that can only be tables."""
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""A decimal number with a point."""
TRUTHS = {"true": 1.0, "false": 0.0}
"""Scores that are truth values."""
SEPARATORS = {";": "semicolons", "\t": "tabs"}
"""Separators of fields that are not supported."""


class ScoreTable(NamedTuple):
    """A table with the unconverted cells of its file or frame."""

    frame: pd.DataFrame
    """Cells by column name."""
    places: Sequence[object]
    """Number of the line, or label of the row, of each row."""
    word: str = "row"
    """Kind of place: line or row."""

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self.frame.columns)

    def place(self, row: int) -> str:
        """Return where a row stands, for a message.

        >>> ScoreTable(pd.DataFrame({"a": ["x"]}), [2], "line").place(0)
        'line 2'
        """
        return f"{self.word} {self.places[row]}"

    def refusal(self, row: int, column: str, value: object, allowed: str) -> SpecError:
        """Return the error that names a cell and what is allowed there."""
        return SpecError(f"{self.place(row)}: {column} = {show(value)}: must be {allowed}")

    def take(self, rows: np.ndarray) -> ScoreTable:
        """Return some rows of the table."""
        places = [self.places[row] for row in rows]
        return ScoreTable(self.frame.iloc[rows].reset_index(drop=True), places, self.word)

    def text(self, column: str) -> pd.Series:
        """Return a column of names as text; blank cells are empty.

        Raises
        ------
        SpecError
            If a cell is no name, or a number and a text are spelled alike.
        """
        cells = self.frame[column].tolist()
        texts = [cell_text(cell) for cell in cells]
        if None in texts:
            row = texts.index(None)
            raise self.refusal(row, column, cells[row], "text or a number")
        kinds: dict[object, tuple[bool, int]] = {}
        for row, (text, cell) in enumerate(zip(texts, cells, strict=True)):
            is_text = isinstance(cell, str) and not isinstance(cell, JsonNumber)
            known, first = kinds.setdefault(text, (is_text, row))
            if text and known != is_text:
                allowed = f"text everywhere or a number everywhere; see {self.place(first)}"
                raise self.refusal(row, column, cell, allowed)
        return pd.Series(texts, dtype=object)

    def filled(self, column: str) -> pd.Series:
        """Return a column of names as `text` does, none of which may be blank."""
        texts = self.text(column)
        blank = (texts == "").to_numpy()
        if blank.any():
            raise SpecError(f"{self.place(int(blank.argmax()))}: {column} is blank")
        return texts

    def numbers(self, column: str) -> pd.Series:
        """Return a column of scores as numbers; true is 1, blank cells are not a number.

        Raises
        ------
        SpecError
            If a score is no finite number, or truth values stand among other numbers.
        """
        cells = self.frame[column].tolist()
        values = np.array([score_value(cell) for cell in cells], dtype=float)
        wrong = abs(values) > MAX_SCORE
        if wrong.any():
            row = int(wrong.argmax())
            raise self.refusal(row, column, cells[row], SCORE_ALLOWED)
        truths = np.array([is_truth(cell) for cell in cells])
        if truths.any() and not np.isin(values[~np.isnan(values)], (0.0, 1.0)).all():
            row = int(truths.argmax())
            raise self.refusal(row, column, cells[row], "a number, as other scores are")
        return pd.Series(values)


MAX_SCORE = 1e100
"""Largest size of a score, so that no variance overflows."""
SCORE_ALLOWED = "a finite number with a decimal point, at most 1e100, or blank"


class JsonNumber(str):
    """A number of a JSON file, as it is written."""

    __slots__ = ()


def is_truth(cell: object) -> bool:
    """Return whether a cell is a truth value, or the text of one."""
    if isinstance(cell, str):
        return cell.strip().lower() in TRUTHS
    return isinstance(cell, bool | np.bool_)


def is_blank(cell: object) -> bool:
    """Return whether a cell is blank."""
    if isinstance(cell, str):
        return not cell.strip()
    return cell is None or (pd.api.types.is_scalar(cell) and bool(pd.isna(cell)))


def cell_text(cell: object) -> str | None:
    """Return a cell as text, empty if it is blank; None if it is a list, a table or bytes.

    Examples
    --------
    >>> [cell_text(cell) for cell in ("0012", 12, 3.1, True, None, [1])]
    ['0012', '12', '3.1', 'true', '', None]
    """
    if is_blank(cell):
        return ""
    if isinstance(cell, str):
        return str(cell)
    if isinstance(cell, bool | np.bool_):
        return str(bool(cell)).lower()
    if isinstance(cell, bytes) or not pd.api.types.is_scalar(cell):
        return None
    return str(cell)


def score_value(cell: object) -> float:
    """Return a score, not a number if it is blank, infinite if it is no finite number.

    Examples
    --------
    >>> [score_value(cell) for cell in ("0.5", "1e3", True, "false", None, "0,5", "nan")]
    [0.5, 1000.0, 1.0, 0.0, nan, inf, inf]
    """
    if is_blank(cell):
        return np.nan
    if isinstance(cell, str):
        text = cell.strip()
        if NUMBER.fullmatch(text):
            return float(text)
        return TRUTHS.get(text.lower(), np.inf)
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return np.inf


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
            frame = pd.read_parquet(path, engine="pyarrow", page_checksum_verification=True)
            return table_of(frame)
        return records_table(read_json(read_text(path), JsonNumber))
    except ImportError:
        raise SpecError(f"{path}: Parquet is read by pyarrow: pip install pyarrow") from None
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
    _check_names(whole.columns)
    return ScoreTable(whole.reset_index(drop=True), whole.index.tolist())


def records_table(records: Any) -> ScoreTable:
    """Return the table of a list of JSON objects, one for each row."""
    is_list = isinstance(records, list) and len(records) > 0
    if not is_list or not all(isinstance(row, dict) for row in records):
        raise SpecError("holds no table of scores: must be a list of objects, [{...}, ...]")
    return ScoreTable(pd.DataFrame(records, dtype=object), range(len(records)))


def _check_names(names: Sequence[str] | pd.Index, where: str = "") -> None:
    seen: set[str] = set()
    for name in names:
        if name and name in seen:
            raise SpecError(f"{where}column {name!r}: stands twice")
        seen.add(name)


def _read_csv(text: str) -> ScoreTable:
    """Return the table of a CSV file; every row must have as many fields as the header."""
    rows = _csv_rows(text)
    line, header = next(rows, (1, []))
    if not header:
        raise SpecError("holds no table of scores: no columns")
    if len(header) == 1:
        for separator, name in SEPARATORS.items():
            if separator in header[0]:
                raise SpecError(f"line {line}: fields are separated by {name}, allowed: commas")
    _check_names(header, f"line {line}: ")
    lines: list[int] = []
    cells: list[list[str]] = []
    for line, row in rows:
        if len(row) != len(header):
            last = header[min(len(row), len(header)) - 1]
            raise SpecError(
                f"line {line}: has {len(row)} fields, the header has {len(header)} "
                f"(last common column {last!r})"
            )
        lines.append(line)
        cells.append(row)
    return ScoreTable(pd.DataFrame(cells, columns=header, dtype=object), lines, "line")


def _csv_rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the fields of each row with the number of its first line; empty lines are left out."""
    reader = csv.reader(StringIO(text, newline=""), strict=True)
    before = 0
    try:
        for row in reader:
            if row:
                yield before + 1, row
            before = reader.line_num
    except csv.Error as error:
        raise SpecError(f"line {before + 1}: {error}") from None


def _read_json_lines(text: str) -> ScoreTable:
    """Return the table of JSON lines; only a line feed ends a line."""
    rows: list[object] = []
    lines: list[int] = []
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        try:
            row = read_json(line, JsonNumber)
        except (ValueError, RecursionError) as error:
            raise SpecError(f"line {number}: {error}") from None
        if not isinstance(row, dict):
            raise SpecError(f"line {number}: must be an object, {{...}}")
        rows.append(row)
        lines.append(number)
    return ScoreTable(pd.DataFrame(rows, dtype=object), lines, "line")
