"""Tables as text, Markdown, HTML and LaTeX for reading, and as CSV and JSON with every digit."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape as in_html
from shutil import get_terminal_size
from textwrap import wrap
from typing import Any, Literal, TextIO

import numpy as np

from ...core.interface.measures import RETURN, SUCCESS, Measure, main_measure
from ...core.numerics import pd
from ...core.plugins.printing import printable
from ...core.plugins.words import expect_each, near
from ..errors import WIDTH, SpecError
from ..results.analysis import Summary, has_lower_bounds
from ..results.notation import P_ADJUSTED, P_RAW, format_estimate, format_p, wrapped
from ..results.spreadsheet import harmless
from ..results.statistics import FEW, exactly, is_at_end, plain, stack_estimates
from .legend import meanings
from .progress import count

Format = Literal["table", "csv", "json"]

FORMATS = {"seed": "d", "episode": "d", "steps": "d", "return": ".4g"}
"""Formats of the values that all scenarios have; measures define the others."""
MISSING = "–"


def text_of(frame: pd.DataFrame, width: int = WIDTH, *, index: bool = True) -> str:
    """Return a table of texts; columns beyond the width follow below, as a further table.

    Headings that are wider than their column have two lines. No column stands alone below others.
    """
    text = _in_lines(frame, width, index=index)
    without_last = _in_lines(frame.iloc[:, :-1], width, index=index)
    if len(frame.columns) < 3 or text.count("\n\n") == without_last.count("\n\n"):
        return text
    parts = frame.iloc[:, :-2], frame.iloc[:, -2:]
    return "\n\n".join(text_of(part, width, index=index) for part in parts)


def _in_lines(frame: pd.DataFrame, width: int, *, index: bool) -> str:
    """Return a table of texts in lines of a width."""
    clean = frame.rename(index=lambda label: printable(str(label)))
    headings = [
        _in_two_lines(printable(title), max(map(len, frame[title]), default=0)) for title in frame
    ]
    if any(above for above, _ in headings):
        clean.columns = pd.MultiIndex.from_tuples(headings)
    else:
        clean.columns = [title for _, title in headings]
    text = clean.to_string(index=index, line_width=width, sparsify=False).replace("  \\\n", "\n")
    lines = "\n".join(map(str.rstrip, text.splitlines()))
    return lines.replace("\n\n\n", "\n\n").lstrip("\n")  # without empty first lines of headings


def _in_two_lines(title: str, width: int) -> tuple[str, str]:
    """Return a heading in two lines if it is wider than its column, otherwise in one.

    >>> _in_two_lines("evaluation success", 6), _in_two_lines("evaluation success", 20)
    (('evaluation', 'success'), ('', 'evaluation success'))
    """
    most = max(width, round(0.6 * len(title)))
    first, *rest = wrap(title, most, break_long_words=False, break_on_hyphens=False) or [""]
    return (first, " ".join(rest)) if rest else ("", first)


def write_rows(
    frame: pd.DataFrame, measures: Sequence[Measure], form: Format, file: TextIO
) -> None:
    """Write a frame of episodes, which has the columns of `measures`.

    CSV and JSON hold every digit, so equal results are equal bytes. Truth values are 0 and 1 in
    CSV, true and false in JSON. The table is rounded, and names condition and phase above their
    rows.
    """
    if form == "csv":
        file.write(in_csv(frame))
    elif form == "json":
        names = list(frame.columns)
        lines = [json.dumps(dict(zip(names, row, strict=True))) for row in rows_of(frame)]
        file.write("[" + ",\n ".join(lines) + "]\n")
    else:
        width = get_terminal_size().columns
        for (condition, phase), rows in frame.groupby(["condition", "phase"], sort=False):
            shown = _shown(rows, {m.name: m for m in measures})
            file.write(f"\n{printable(condition)}, {printable(phase)}\n")
            file.write(f"{text_of(shown, width, index=False)}\n")


def _shown(frame: pd.DataFrame, measures: dict[str, Measure]) -> pd.DataFrame:
    """Return the rows of one condition as texts.

    What equals success in every row, such as that the box stopped at the goal, is left out; so is
    success where nothing is one.
    """
    shown = frame[[name for name in frame.columns if name in FORMATS or name in measures]]
    if SUCCESS.name in shown:
        same = [n for n in shown if n in measures and shown[n].equals(shown[SUCCESS.name])]
        shown = shown.drop(columns=[name for name in same if name != SUCCESS.name])
        if main_measure([measures.get(SUCCESS.name, SUCCESS)]) == RETURN:
            shown = shown.drop(columns=SUCCESS.name)
    return pd.DataFrame(
        {
            measures[name].heading if name in measures else name: _cells(own, measures.get(name))
            for name, own in shown.items()
        }
    )


def _cells(column: pd.Series, measure: Measure | None) -> list[str]:
    """Return the values of a column as text: two or three decimals for measures, unless large."""
    if measure is None:
        form = FORMATS[str(column.name)]
    elif measure.is_rate:
        form = "d"
    elif column.abs().max() >= 1000.0:
        form = ".4g"
    else:
        form = ".2f" if measure.unit == "1" else ".3f"
    return [
        MISSING if value is None else format(value, form) for (value,) in rows_of(column.to_frame())
    ]


def write_csv(file: TextIO, names: Iterable[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a header and rows; None becomes an empty cell."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(map(harmless, names))
    writer.writerows(map(harmless, row) for row in rows)


def in_csv(frame: pd.DataFrame) -> str:
    """Return a frame with a header; truth values are 0 and 1, what is missing is an empty cell."""
    file = io.StringIO()
    write_csv(file, frame.columns, rows_of(frame))
    return file.getvalue()


def in_parquet(frame: pd.DataFrame) -> bytes:
    """Return a frame as a Parquet file with checksums; columns of mixed types become text.

    Raises
    ------
    SpecError
        If pyarrow is not installed.
    """
    mixed = {
        name: column.map(str, na_action="ignore")
        for name, column in frame.items()
        if column.dtype == object and column.dropna().map(type).nunique() > 1
    }
    try:
        return frame.assign(**mixed).to_parquet(engine="pyarrow", write_page_checksum=True)
    except ImportError:
        raise SpecError(
            "--format parquet: pyarrow is not installed; pip install 'nested-agents[parquet]'"
        ) from None


def rows_of(frame: pd.DataFrame) -> Iterator[tuple[object, ...]]:
    """Yield the rows of a frame as values of Python's own types; None is what is missing."""
    yield from frame.astype(object).where(frame.notna(), None).itertuples(index=False, name=None)


IN_LATEX = {">= ": r"\\ge", r" \[": r"\\;[", r"e(-?\d+)": r"\\times 10^{\1}"}
"""Parts of estimates as patterns, and in LaTeX."""
MARKUP = re.compile(r"[\\`*<|$~]|&(?=#?\w+;)|\](?=[(\[])|\b_|_\b")
"""Characters that Markdown does not show as they are."""
UNKNOWN = exactly(np.nan)


@dataclass(frozen=True)
class SummaryTable:
    """A table in its forms."""

    titles: tuple[str, ...]
    """Headings of the estimates."""
    lines: tuple[Summary, ...]
    """Lines of the table. It prints as on a terminal of 80 columns; notebooks show HTML."""

    remark: str = ""
    """Remark on the intervals; by default how those of rates and other means are computed."""

    def __str__(self) -> str:
        return "\n".join([self.text(), "", *self.legend] if self.lines else self.legend)

    @cached_property
    def cells(self) -> pd.DataFrame:
        """Estimates with intervals as text, empty where there is none, a row for each line."""
        rows = [[_cell(line, title) for title in self.titles] for line in self.lines]
        return pd.DataFrame(rows, columns=list(self.titles), dtype=object)

    def text(self, width: int = WIDTH) -> str:
        """Return a line of estimates for each condition, each with its 95% interval.

        Labels have the number of seeds if conditions differ in it; the verdicts have p-values.
        """
        if not self.lines:
            return ""
        labels = [
            line.condition if self.seeds else f"{line.condition} ({count(line.seeds, 'seed')})"
            for line in self.lines
        ]
        cells = self.cells.drop(columns=[P_ADJUSTED, P_RAW], errors="ignore")
        return text_of(cells.apply(_aligned).set_axis(labels), width)

    @property
    def seeds(self) -> int:
        """Number of seeds of all lines; 0 if they differ."""
        (least, *more) = {line.seeds for line in self.lines} or {0}
        return 0 if more else least

    @property
    def legend(self) -> list[str]:
        """Lines that explain the cells."""
        if not self.lines:
            return ["no trial has finished"]
        if self.seeds == 1:
            return ["Values of 1 seed, without intervals."]
        over = count(self.seeds, "seed") if self.seeds else "seeds"
        usual = (
            "Rates have Wilson intervals. Other means have bootstrap intervals, which are too "
            "short if values are skewed."
        )
        if any(line.seeds < FEW for line in self.lines):
            usual = f"Fewer than {FEW} seeds: rates have Wilson intervals, other means Student's."
        lines = [
            f"Means over {over} with 95% intervals.",
            *wrapped(self.remark or usual),
        ]
        if any(is_at_end(e) for line in self.lines for e in line.estimates.values()):
            lines.append("Means at a limit of their range have Wilson intervals, scaled to it.")
        if has_lower_bounds(self.lines):
            lines.append("Lower bounds (>=): some values are only known to be larger.")
        is_estimate = (self.cells != "") & ~self.cells.map(lambda text: text.startswith(">="))
        has_interval = self.cells.map(lambda text: "[" in text).where(is_estimate)
        if (has_interval.nunique() > 1).any():
            lines.append("Without an interval: one seed has the value, or all seeds have the same.")
        return lines

    @property
    def meanings(self) -> dict[str, str]:
        """Explanations of the columns by heading, as far as they are known."""
        return meanings(self.titles)

    @property
    def csv(self) -> str:
        """The whole table as CSV, with every digit; p-values have no bounds."""
        columns: dict[str, Any] = {"condition": [line.condition for line in self.lines]}
        columns["seeds"] = [line.seeds for line in self.lines]
        for title in self.titles:
            parts = stack_estimates([line.estimates.get(title, UNKNOWN) for line in self.lines])
            names = (title, f"{title} low", f"{title} high")
            columns |= zip(names[: 1 if title in (P_ADJUSTED, P_RAW) else 3], parts, strict=False)
        return in_csv(pd.DataFrame(columns))

    @property
    def json(self) -> str:
        """The whole table as JSON with every digit; unknown bounds are null.

        Each row has ``condition``, ``seeds`` and ``estimates``, which maps each title to its
        ``value``, ``low`` and ``high``.
        """
        rows = []
        for line in self.lines:
            known = {t: e for t, e in line.estimates.items() if t in self.titles}
            rows.append(json.dumps(plain(line._replace(estimates=known)._asdict())))
        return "[" + ",\n ".join(rows) + "]\n"

    @property
    def markdown(self) -> str:
        """The whole table in Markdown."""
        titles = [*map(_in_markdown, ["condition", "seeds", *self.titles])]
        rows = [titles, ["---"] * len(titles)]
        for line, cells in zip(self.lines, rows_of(self.cells), strict=True):
            rows.append([_in_markdown(line.condition), str(line.seeds), *map(str, cells)])
        return "".join(f"| {' | '.join(row)} |\n" for row in rows)

    @property
    def html(self) -> str:
        """The table as HTML."""
        index = [f"{line.condition}, {count(line.seeds, 'seed')}" for line in self.lines]
        table = self.cells.set_axis(index).to_html(border=0)
        return f"{table}<p><small>{in_html(' '.join(self.legend))}</small></p>"

    @property
    def latex(self) -> str:
        """The whole table in LaTeX."""
        maths = self.cells.replace(IN_LATEX, regex=True)
        cells = maths.map(lambda text: f"${text}$" if text else "--")
        cells.insert(0, "condition", [line.condition for line in self.lines])
        cells.insert(1, "seeds", [line.seeds for line in self.lines])
        note = "; 95% intervals in brackets"
        return in_latex(cells, "condition", f"lr{'r' * len(self.titles)}", note)

    def _repr_html_(self) -> str:
        return self.html


def _cell(line: Summary, title: str) -> str:
    """Return an estimate of a line as text; empty if there is none."""
    estimate = line.estimates.get(title)
    if estimate is None:
        return ""
    if title in (P_ADJUSTED, P_RAW):
        return format_p(float(estimate.value)).removeprefix("= ")
    return format_estimate(estimate)


def tabulate(
    lines: Sequence[Summary], columns: Sequence[str] = (), remark: str = ""
) -> SummaryTable:
    """Return the table of summaries, which may have different estimates.

    It has copies of the estimates: changing them changes no result.

    Parameters
    ----------
    lines
        Its lines.
    columns
        Titles of the estimates that it has, with or without units; all if none are named.
    remark
        Remark on the intervals, if they are not those of rates and means.

    Raises
    ------
    SpecError
        If there are no estimates of a title.
    """
    expect_each("titles of columns", str, columns=columns)
    titles = tuple(dict.fromkeys(title for line in lines for title in line.estimates))
    without_units = {title.partition(" [")[0]: title for title in titles}
    columns = [
        column if column in titles else without_units.get(column, column) for column in columns
    ]
    for column in columns:
        if column not in titles:
            has = f"it has {', '.join(map(repr, titles)) or 'none'}"
            hint = f"{near(column, titles)} {has}".lstrip()
            raise SpecError(f"columns: the table has no {column!r}; {hint}")
    own = tuple(line._replace(estimates=dict(line.estimates)) for line in lines)
    return SummaryTable(tuple(columns) or titles, own, remark)


def in_latex(frame: pd.DataFrame, names: str, columns: str, note: str = "") -> str:
    """Return a frame of LaTeX as a table of booktabs, a line after the other.

    The column `names` is plain text that needs escaping, as headings do; `columns` are the
    arguments of ``tabular``. A comment above the table names the package, followed by `note`.
    """
    clean = frame.assign(**{names: frame[names].map(_in_one_line)}).rename(columns=_in_one_line)
    style = clean.style.hide(axis="index").format_index(_protected, escape="latex", axis=1)
    text = style.format(_protected, escape="latex", subset=names).to_latex(
        column_format=columns, hrules=True
    )
    return f"% needs \\usepackage{{booktabs}}{note}\n{text}"


def _protected(text: str) -> str:
    """Return escaped text that LaTeX does not take for an option of the line before.

    Characters that its default font lacks are set in math mode.
    """
    return "{}" * text.startswith(("[", "*")) + re.sub(r"[<>|]", r"$\g<0>$", text)


def _in_markdown(text: str) -> str:
    r"""Return text in which no character is markup, on one line.

    >>> _in_markdown("<b>a|b</b> and\n2 * c")
    '\\<b>a\\|b\\</b> and 2 \\* c'
    """
    return MARKUP.sub(r"\\\g<0>", _in_one_line(text))


def _in_one_line(text: str) -> str:
    """Return text with control characters escaped and line breaks replaced by spaces."""
    return " ".join(printable(text).split())


def _aligned(cells: Sequence[str]) -> list[str]:
    """Return cells in which values end, and intervals begin, at one place."""
    parts = [cell.partition(" [") for cell in cells]
    value = max(len(value) for value, *_ in parts)
    interval = max(len(interval) for *_, interval in parts)
    return [f"{v:>{value}}{mark:<2}{i:<{interval}}" for v, mark, i in parts]
