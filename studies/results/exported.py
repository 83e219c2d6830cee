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
from .foreign import score_kind
from .long_form import KEYS, pack, plain_levels, refuse_repeated, whole_names
from .results import DONE, TRIAL_COLUMNS, Results, assemble
from .score_files import NUMBER, ScoreTable
from .spreadsheet import harmless

EPISODES = ("condition", "seed", "phase", "episode", "steps")
"""Columns by which a table of episodes is recognized."""
TRIALS = ("condition", "seed", "state", "identity")
"""Columns by which a table of trials is recognized."""


class Description(NamedTuple):
    """Description of an exported study besides its rows."""

    conditions: Mapping[str, SpecTable]
    """Swept keys by condition, in the order of the study."""
    measures: Sequence[Measure]


class Exported(NamedTuple):
    """Results of an exported table, with remarks."""

    results: Results
    conditions: Mapping[str, SpecTable]
    notes: tuple[str, ...]


def is_exported(table: ScoreTable, *, is_listed: bool = False) -> bool:
    """Return whether a table has the columns of an exported study.

    Tables of scores may have them, too, unless the file that describes a study lists the table.
    """
    names = {*table.columns}
    is_other = "score" in names and not is_listed
    return not is_other and ({*EPISODES} <= names or {*TRIALS} <= names)


def results_of(table: ScoreTable, known: Description | None) -> Exported:
    """Return the results of an exported table, in any order of its rows and columns.

    Raises
    ------
    SpecError
        If a cell is not what was exported; one line names its line and column.
    """
    labels = table.filled("condition")
    swept = _swept(table, labels, known)
    conditions, labels = _conditions(table, labels, swept, known)
    if {*TRIALS} <= {*table.columns}:
        return _trials(table, conditions, labels, swept)
    keys = {
        "condition": labels,
        "phase": table.filled("phase"),
        "seed": whole_names(table.filled("seed")),
        "episode": _whole(table, "episode"),
    }
    names = [name for name in table.columns if name not in (*EPISODES, *swept)]
    values = {name: table.numbers(name) for name in names}
    frame = pd.DataFrame({**keys, "steps": _whole(table, "steps"), **values})
    refuse_repeated(table, frame, {key: key for key in KEYS})
    notes: list[str] = []
    if known is None:
        measures, notes = _measures(frame, names)
    else:
        measures = [m for m in known.measures if m.name in names]
        missing = ", ".join(m.name for m in known.measures if m.name not in names)
        notes = [f"no column {missing}, which study.json has"] if missing else []
    return Exported(pack(frame, conditions, measures), conditions, tuple(notes))


def _trials(
    table: ScoreTable,
    conditions: Mapping[str, SpecTable],
    labels: pd.Series,
    swept: Sequence[str],
) -> Exported:
    """Return the numbers of whole trials; those of trials that have not finished are left out."""
    frame = pd.DataFrame({"condition": labels, "seed": whole_names(table.filled("seed"))})
    numbers = [name for name in table.columns if name not in (*TRIAL_COLUMNS, *swept)]
    frame = frame.assign(
        state=table.filled("state"), **{name: table.numbers(name) for name in numbers}
    )
    refuse_repeated(table, frame, {key: key for key in ("condition", "seed")})
    results = assemble([], [frame], (), conditions, (), ())
    unfinished = int((frame["state"] != DONE).sum())
    note = f"{unfinished} of {len(frame)} trials have not finished: left out"
    return Exported(results, conditions, (note,) if unfinished else ())


def _swept(table: ScoreTable, labels: pd.Series, known: Description | None) -> list[str]:
    """Return the columns that are swept keys.

    Where the study is not known, these are the columns before the seed or, if columns are in
    another order, those that are constant within each condition.
    """
    names = table.columns
    if known is not None:
        keys = {key for row in known.conditions.values() for key in row}
        return [name for name in names if name in keys]
    first, seed = names.index("condition"), names.index("seed")
    if first == 0 and [n for n in names if n in EPISODES] in ([*EPISODES], ["condition", "seed"]):
        return names[1:seed]
    others = [n for n in names if n not in (*EPISODES, *TRIAL_COLUMNS, SUCCESS.name, RETURN.name)]
    groups = {name: table.text(name).groupby(labels).nunique() for name in others}
    return [name for name, counts in groups.items() if (counts == 1).all()]


def _conditions(
    table: ScoreTable, labels: pd.Series, swept: Sequence[str], known: Description | None
) -> tuple[Mapping[str, SpecTable], pd.Series]:
    """Return the conditions with their swept keys, and the label of each row."""
    if known is not None:
        written = {str(harmless(condition)): condition for condition in known.conditions}
        strange = ~labels.isin(list(written)).to_numpy()
        if strange.any():
            row = int(strange.argmax())
            allowed = "a condition of study.json in its folder"
            raise table.refusal(row, "condition", labels[row], allowed)
        labels = labels.map(written)
        _check_levels(table, labels, swept, known.conditions)
        return known.conditions, labels
    levels = pd.DataFrame({key: plain_levels(table.text(key)) for key in swept}, labels.index)
    rows = levels.assign(condition=labels).drop_duplicates("condition").to_dict("records")
    return {row.pop("condition"): row for row in rows}, labels


def _check_levels(
    table: ScoreTable,
    labels: pd.Series,
    swept: Sequence[str],
    conditions: Mapping[str, SpecTable],
) -> None:
    """Refuse a swept value that is not the one that study.json has for the row's condition."""
    for key in swept:
        cells = pd.DataFrame({"condition": labels, "cell": table.text(key)}).drop_duplicates()
        for row, condition, cell in cells.itertuples():
            value = conditions[condition].get(key, "")
            if isinstance(value, str | int | float) and not _is_spelled(cell, value):
                allowed = f"{show(value)}, the value of condition {condition!r} in study.json"
                raise table.refusal(row, key, cell, allowed)


def _is_spelled(cell: str, value: float | str) -> bool:
    """Return whether a cell is a swept value, as one of the exported forms writes it."""
    if NUMBER.fullmatch(cell) and not isinstance(value, str):
        return float(cell) == value
    return cell in (value, str(harmless(value)), str(value).lower())


def _whole(table: ScoreTable, column: str) -> pd.Series:
    """Return a column of whole numbers, none below 0."""
    numbers = table.numbers(column)
    wrong = ~((numbers >= 0) & (numbers % 1 == 0)).to_numpy()
    if wrong.any():
        row = int(wrong.argmax())
        raise table.refusal(row, column, table.frame[column].iloc[row], "a whole number from 0 on")
    return numbers.astype(int)


def _measures(frame: pd.DataFrame, names: Sequence[str]) -> tuple[list[Measure], list[str]]:
    """Return the measures of an export without a description."""
    notes = [
        "no study.json in its folder: which values are better is known of success and return only"
    ]
    measures = []
    for name in names:
        if name == SUCCESS.name:
            is_possible = frame[name].any() or RETURN.name not in names
            measures.append(SUCCESS if is_possible else NO_SUCCESS)
        elif name != RETURN.name:
            measures.append(Measure(name, name, is_rate=score_kind(frame, name) == "rate"))
    if measures and measures[0] == NO_SUCCESS:
        notes.append("success: never in any episode; returns are compared")
    return measures, notes
