"""Results that no study here has made: a table of scores, as CSV, JSON lines or Parquet.

A row is one score of a condition: by a run (its seed), on an item (a question, a task, an episode),
or both. Conditions are compared on the seeds that both have; without seeds, on the items. What is
measured on an item stands where a study has an episode of evaluation.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest, show
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..spec.tables import label
from ..store.durable import check_file, read_text
from .results import Array, Results, from_arrays

PHASE = "evaluation"
"""Of all that is measured."""
BLANK = -1
"""Code of a run of which no seed is known."""
CONDITION, RUN, ITEM = ("its condition", "its run", "its item")
"""Columns of a table of scores, beside those of scores, once it has been read."""
RESERVED = ("seed", "phase", "episode", "steps", "return", "state")
"""Columns of results, which have a meaning there: a table's own of these names are called anew."""


class ScoreColumns(NamedTuple):
    """Which columns of a table are what."""

    condition: tuple[str, ...] = ("condition",)
    """What is compared; several columns are crossed."""
    score: tuple[str, ...] = ("score",)
    """What is measured, each a measure."""
    seed: str | None = None
    """Which run it is of; none: items are compared one by one."""
    item: str | None = None
    """On what it was measured; none: rows of a run are averaged."""

    @classmethod
    def parse(cls, pairs: Sequence[str], known: Sequence[str]) -> ScoreColumns:
        """Return what ``ROLE=COLUMN`` says, ``+`` between columns; else those called as their role.

        Parameters
        ----------
        pairs
            One or several, also with commas between them.
        known
            The columns of the table.

        Raises
        ------
        SpecError
            If a role is unknown or given twice.

        Examples
        --------
        >>> ScoreColumns.parse(["condition=topology+model,score=right"], ["topology", "seed"])
        ScoreColumns(condition=('topology', 'model'), score=('right',), seed='seed', item=None)
        """
        given: dict[str, str] = {}
        for pair in (part for text in pairs for part in text.split(",")):
            role, _, column = pair.partition("=")
            if role not in cls._fields or not column or role in given:
                raise SpecError(
                    f"columns = {pair!r}: must be ROLE=COLUMN, each role once: "
                    f"{', '.join(cls._fields)}"
                )
            given[role] = column
        return cls(
            condition=tuple(given.get("condition", "condition").split("+")),
            score=tuple(given.get("score", "score").split("+")),
            seed=given.get("seed", "seed" if "seed" in known else None),
            item=given.get("item", "item" if "item" in known else None),
        )


Labels = dict[str, dict[str, object]]
"""By condition, what tells it from the others."""


class Foreign(NamedTuple):
    """Results of a table, and what must be given of them."""

    outline: StudyOutline
    results: Results
    remarks: tuple[str, ...]


def read_table(path: Path) -> pd.DataFrame:
    """Return the table of a file, by its suffix: ``.csv``, ``.jsonl`` or ``.parquet``.

    Raises
    ------
    SpecError
        If it cannot be read, or what reads it is not installed; one line.
    """
    try:
        if path.suffix == ".csv":
            return pd.read_csv(StringIO(read_text(path)))
        if path.suffix == ".jsonl":
            rows = [json.loads(line) for line in read_text(path).splitlines() if line.strip()]
            if not all(isinstance(row, dict) for row in rows):
                raise ValueError("every line must be a table, {...}")
            return pd.DataFrame(rows)
        check_file(path)
        return pd.read_parquet(path)
    except ImportError:
        raise SpecError(f"{path}: Parquet is read by pyarrow: pip install pyarrow") from None
    except (OSError, ValueError, RecursionError) as error:
        line = str(error).partition("\n")[0]
        raise SpecError(f"{path}: holds no table of scores: {line}") from None


SUFFIXES = (".csv", ".jsonl", ".parquet")
"""Of files that `read_table` reads."""


def results_of(
    table: pd.DataFrame, columns: ScoreColumns, better: Literal["higher", "lower"] = "higher"
) -> Foreign:
    """Return the results that a table of scores holds.

    Rows without a score are left out, and items that not all runs have. A row without a seed, where
    others have one, is a published figure: it is shown, and compared with nothing.

    Parameters
    ----------
    table
        A row for each score.
    columns
        What is what.
    better
        Which scores are better. Those that are 0 or 1 throughout are rates.

    Raises
    ------
    SpecError
        If a column is missing, a score is no finite number, a row stands twice, or nothing is left.
    """
    _check_columns(table, columns)
    remarks: list[str] = []
    known = table.dropna(subset=list(columns.score))
    if len(known) < len(table):
        remarks.append(f"{len(table) - len(known)} of {len(table)} rows have no score: left out")
    if known.empty:
        raise SpecError(f"score = {'+'.join(columns.score)!r}: no row has one")
    frame = pd.DataFrame({name: _numbers(known[name]) for name in columns.score})
    frame[CONDITION] = known[list(columns.condition)].agg(_label, axis=1)
    unit = columns.seed or columns.item
    if unit is None:  # every row is a run of its own
        frame[RUN] = frame.groupby(CONDITION).cumcount()
    else:
        frame[RUN] = _codes(known[unit])
        _check_published(frame)
    if columns.seed is None and columns.item is not None:
        remarks.append(f"a seed below is one value of {unit!r}: conditions are compared on these")
    whole = frame.groupby([CONDITION, RUN], sort=False).mean().reset_index()
    if columns.seed is not None and columns.item is not None:
        frame[ITEM] = _codes(known[columns.item])
        whole, left_out = _shared_items(frame, columns.seed, columns.item)
        remarks += left_out
    first = known.assign(**{CONDITION: frame[CONDITION]}).drop_duplicates(CONDITION)
    labels: Labels = {
        row[CONDITION]: {_own_name(n): row[n] for n in columns.condition if n != "condition"}
        for row in first.to_dict("records")
    }
    measures = tuple(_measure(name, frame[name], whole[name], better) for name in columns.score)
    outline = {"study": "learning-curve", "seeds": 1, "episodes": 0, "steps": 0, "evaluation": 1}
    results = _packed(whole, labels, measures)
    return Foreign(StudyOutline.noted(outline, labels), results, tuple(remarks))


def _own_name(name: str) -> str:
    return f"{name} (own)" if name in RESERVED else name


def _check_columns(table: pd.DataFrame, columns: ScoreColumns) -> None:
    wanted = [("condition", name) for name in columns.condition]
    wanted += [("score", name) for name in columns.score]
    wanted += [(r, n) for r, n in (("seed", columns.seed), ("item", columns.item)) if n]
    names = [name for _, name in wanted]
    for role, name in wanted:
        if name not in table:
            hint = closest(name, [str(column) for column in table.columns])
            raise SpecError(f"columns: {role} = {name!r}: no such column; {hint}")
        if names.count(name) > 1:
            raise SpecError(f"columns: {role} = {name!r}: is named twice")
        cells = table[name]
        nested = ~cells.map(pd.api.types.is_scalar)
        if nested.any():
            row = cells.index[nested][0]
            raise SpecError(f"{name} = {show(cells[row])} in row {row}: must be text or a number")
        if role == "condition" and cells.isna().any():
            row = cells.index[cells.isna()][0]
            raise SpecError(f"{name} is blank in row {row}: every score is of a condition")


def _numbers(column: pd.Series) -> pd.Series:
    """Return scores as numbers; true is 1."""
    numbers = pd.to_numeric(column.replace({True: 1, False: 0}), errors="coerce").astype(float)
    wrong = ~np.isfinite(numbers.to_numpy())
    if wrong.any():
        value = column[wrong].iloc[0]
        row = column.index[wrong][0]
        raise SpecError(f"{column.name} = {show(value)} in row {row}: must be a finite number")
    return numbers


def _label(row: pd.Series) -> str:
    return str(row.iloc[0]) if len(row) == 1 else label(row.to_dict())


def _codes(column: pd.Series) -> pd.Series:
    """Return whole numbers from 0 on as they are, other values by their order, blank as `BLANK`."""
    numbers = pd.to_numeric(column, errors="coerce")
    whole = numbers[numbers.notna()]
    is_whole = len(whole) == column.notna().sum() and bool(((whole >= 0) & (whole % 1 == 0)).all())
    codes = numbers if is_whole else pd.Series(pd.factorize(column, sort=True)[0], column.index)
    return codes.fillna(BLANK).astype(int)


def _check_published(frame: pd.DataFrame) -> None:
    """Refuse a condition some of whose rows have a seed, and others none."""
    blank = (frame[RUN] == BLANK).groupby(frame[CONDITION]).mean()
    mixed = blank.index[(blank > 0.0) & (blank < 1.0)]
    if len(mixed):
        raise SpecError(f"condition {mixed[0]!r}: some of its rows have a seed, others none")


def _shared_items(frame: pd.DataFrame, seed: str, item: str) -> tuple[pd.DataFrame, list[str]]:
    """Return a table in which every run has the same items, and what was left out for that."""
    known = frame[frame[RUN] != BLANK]
    twice = known[known.duplicated([CONDITION, RUN, ITEM])]
    if len(twice):
        row = twice.index[0]
        where = f"condition {twice.loc[row, CONDITION]!r}"
        raise SpecError(f"row {row}: {where}, {seed} and {item} stand in a row before, too")
    times = known.groupby(ITEM).size()
    n_runs = known.groupby([CONDITION, RUN]).ngroups
    shared = times.index[times == n_runs]
    if not len(shared):
        raise SpecError(f"item = {item!r}: no item has a score of all {n_runs} runs")
    published = frame[frame[RUN] == BLANK].groupby([CONDITION, RUN]).mean().reset_index()
    whole = pd.concat([known[known[ITEM].isin(shared)], published], ignore_index=True)
    if len(shared) == len(times):
        return whole, []
    fewer = len(times) - len(shared)
    return whole, [f"{fewer} of {len(times)} values of {item!r} are not of all runs: left out"]


def _measure(
    name: str, scores: pd.Series, means: pd.Series, better: Literal["higher", "lower"]
) -> Measure:
    """Return the measure of scores, or of their means where runs have several rows."""
    are_flags = bool(scores.isin((0.0, 1.0)).all())
    is_rate = are_flags and bool(means.isin((0.0, 1.0)).all())
    if is_rate and name == SUCCESS.name and better == "higher":
        return SUCCESS
    least, greatest = (0.0, 1.0) if are_flags else (None, None)
    own = _own_name(name)
    return Measure(own, name, is_rate=is_rate, better=better, least=least, greatest=greatest)


def _packed(frame: pd.DataFrame, labels: Labels, measures: tuple[Measure, ...]) -> Results:
    """Return the results of a table in which every run has the same items."""
    frame = frame.sort_values([name for name in (RUN, ITEM) if name in frame])
    arrays: dict[str, dict[str, Array]] = {}
    seeds: dict[str, list[int]] = {}
    beyond = int(frame[RUN].max()) + 1  # no other condition has it
    for condition in labels:
        own = frame[frame[CONDITION] == condition]
        seeds[condition] = [beyond if s == BLANK else s for s in own[RUN].unique().tolist()]
        arrays[condition] = {
            m.name: own[m.title].to_numpy().reshape(len(seeds[condition]), -1) for m in measures
        }
    return from_arrays({PHASE: arrays}, seeds, {}, {}, labels, measures)
