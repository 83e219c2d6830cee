"""Exported tables of a study, read back: its episodes, or its trials.

They are recognized by their columns. The file ``study.json`` in their folder describes the columns;
without it, conditions are in the order of the rows, and which values are better is not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...core.interface.measures import NO_SUCCESS, RETURN, SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import show
from ..spec.tables import SpecTable
from .results import DONE, TRIAL_COLUMNS, assemble
from .results_file import Header
from .score_tables import NUMBER, ScoreTable
from .scores import (
    KEYS,
    ScoreResults,
    measure_of,
    plain_levels,
    refuse_repeated,
    results_of,
    whole_names,
)
from .spreadsheet import harmless

EPISODES = ("condition", "seed", "phase", "episode", "steps")
"""Columns by which a table of episodes is recognized."""
TRIALS = ("condition", "seed", "state", "identity")
"""Columns by which a table of trials is recognized."""


class Description(NamedTuple):
    """What a table of an exported study does not say of its columns."""

    columns: Mapping[str, SpecTable]
    """Swept keys by condition, in the order of the study."""
    measures: Sequence[Measure]
    notes: Sequence[str] = ()


def is_exported(table: ScoreTable, *, is_listed: bool = False) -> bool:
    """Return whether a table has the columns of an exported study.

    Tables of scores may have them, too, unless the file that describes a study lists the table.
    """
    names = {*table.columns}
    is_other = "score" in names and not is_listed
    return not is_other and ({*EPISODES} <= names or {*TRIALS} <= names)


def read_export(table: ScoreTable, header: Header | None) -> ScoreResults:
    """Return the results of an exported table, in any order of its rows and columns.

    Raises
    ------
    SpecError
        If a cell is not what was exported; one line names its line and column.
    """
    if header is None:
        known = _describe(table)
    else:
        missing = [m.name for m in header.measures if m.name not in table.columns]
        notes = [f"no column {', '.join(missing)}, which study.json has"] if missing else []
        present = [m for m in header.measures if m.name not in missing]
        known = Description(header.columns, present, notes)
    written = {text: c for c in known.columns for text in (c, str(harmless(c)))}
    cells = table.names("condition")
    unknown = ": must be a condition of study.json in its folder"
    table.refuse(~cells.isin(list(written)), "condition", unknown)
    keys = pd.DataFrame({"condition": cells.map(written), "seed": whole_names(table.names("seed"))})
    swept = {key for row in known.columns.values() for key in row}
    _check_levels(table, keys["condition"], known.columns)
    if {*TRIALS} <= {*table.columns}:
        return _read_trials(table, keys, known.columns)
    scores = keys.assign(
        phase=table.names("phase"), episode=_whole(table, "episode"), steps=_whole(table, "steps")
    )
    values = {n: table.numbers(n) for n in table.columns if n not in (*EPISODES, *swept)}
    scores = scores.assign(**values)
    refuse_repeated(table, scores, {key: key for key in KEYS})
    return ScoreResults(results_of(scores, known.columns, known.measures), tuple(known.notes))


def _read_trials(
    table: ScoreTable, keys: pd.DataFrame, columns: Mapping[str, SpecTable]
) -> ScoreResults:
    """Return the numbers of whole trials; those of trials that have not finished are left out."""
    refuse_repeated(table, keys, {"condition": "condition", "seed": "seed"})
    others = {*TRIAL_COLUMNS, *(key for row in columns.values() for key in row)}
    numbers = {name: table.numbers(name) for name in table.columns if name not in others}
    trials = keys.assign(state=table.names("state"), **numbers)
    unfinished = int((trials["state"] != DONE).sum())
    note = f"{unfinished} of {len(trials)} trials have not finished: left out"
    results = assemble([], [trials], (), columns, (), ())
    return ScoreResults(results, (note,) if unfinished else ())


def _describe(table: ScoreTable) -> Description:
    """Return the description of a table without ``study.json``.

    Swept keys are the columns before the seed or, if columns are in another order, those that are
    constant within each condition.
    """
    names = table.columns
    labels = table.names("condition")
    first, seed = names.index("condition"), names.index("seed")
    if first == 0 and [n for n in names if n in EPISODES] in ([*EPISODES], ["condition", "seed"]):
        swept = names[1:seed]
    else:
        known = (*EPISODES, *TRIAL_COLUMNS, SUCCESS.name, RETURN.name)
        others = {name: table.text(name) for name in names if name not in known}
        swept = [n for n, own in others.items() if (own.groupby(labels).nunique() == 1).all()]
    levels = pd.DataFrame({key: plain_levels(table.text(key)) for key in swept}, labels.index)
    is_first = ~labels.duplicated()
    rows = levels[is_first].to_dict("records")
    columns = dict(zip(labels[is_first], rows, strict=True))
    if not {*EPISODES} <= {*names}:
        return Description(columns, ())
    measured = [n for n in names if n not in (*EPISODES, *swept, RETURN.name)]
    return Description(columns, *_measures(table, labels, measured))


def _measures(
    table: ScoreTable, labels: pd.Series, names: Sequence[str]
) -> tuple[list[Measure], list[str]]:
    """Return the measures of an export without a description, and remarks on them."""
    notes = [
        "no study.json in its folder: which values are better is known of success and return only"
    ]
    keys = pd.DataFrame({"condition": labels, **{key: table.text(key) for key in KEYS[1:]}})
    measures = []
    for name in names:
        values = table.numbers(name)
        if name != SUCCESS.name:
            measures.append(measure_of(keys.assign(**{name: values}), name, name, None))
        elif values.any() or RETURN.name not in table.columns:
            measures.append(SUCCESS)
        else:
            measures.append(NO_SUCCESS)
    if NO_SUCCESS in measures:
        notes.append("success: never in any episode; returns are compared")
    return measures, notes


def _check_levels(
    table: ScoreTable, labels: pd.Series, conditions: Mapping[str, SpecTable]
) -> None:
    """Refuse a swept value that is not the one that is known for the row's condition."""
    keys = dict.fromkeys(key for row in conditions.values() for key in row)
    for key in (key for key in keys if key in table.columns):
        cells = pd.DataFrame({"condition": labels, "cell": table.text(key)}).drop_duplicates()
        for row, condition, cell in cells.itertuples():
            value = conditions[condition].get(key, "")
            if isinstance(value, str | int | float) and not _is_spelled(cell, value):
                allowed = f"{show(value)}, the value of condition {condition!r} in study.json"
                table.refuse(labels.index == row, key, f": must be {allowed}")


def _is_spelled(cell: str, value: float | str) -> bool:
    """Return whether a cell is a swept value, as one of the exported forms writes it."""
    if NUMBER.fullmatch(cell) and not isinstance(value, str):
        return float(cell) == value
    return cell in (value, str(harmless(value)), str(value).lower())


def _whole(table: ScoreTable, column: str) -> pd.Series:
    """Return a column of whole numbers, none below 0."""
    numbers = table.numbers(column)
    is_whole = (numbers >= 0) & (numbers % 1 == 0)
    table.refuse(~is_whole, column, ": must be a whole number from 0 on")
    return numbers.astype(int)
