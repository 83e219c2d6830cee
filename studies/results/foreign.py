"""Results of other tools, read from a table of scores.

A row is one score of a condition: of a run (its seed), on an item (a question, a task, an episode),
or both; in a phase, and at a step of training. Runs and items are paired by name. A table that
names neither holds independent samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Literal, NamedTuple

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..spec.tables import label
from .long_form import (
    UNNAMED,
    pack,
    plain_levels,
    refuse_repeated,
    sort_labels,
    whole_names,
)
from .results import Results
from .score_files import ScoreTable
from .series import at_last_step

PHASE = "evaluation"
"""Phase of the scores of a table that names none."""
RESERVED = ("condition", "seed", "phase", "episode", "step", "steps", "return", "state")
"""Names of columns of results; columns of a table with these names get other ones."""
LABEL = "label of the condition"
Better = Literal["higher", "lower"]


class ScoreColumns(NamedTuple):
    """The role of each column of a table."""

    condition: tuple[str, ...] = ("condition",)
    """Columns of the compared conditions; several columns are crossed."""
    score: tuple[str, ...] = ("score",)
    """Columns of scores, each a measure."""
    seed: str | None = None
    """Name of the run."""
    item: str | None = None
    """Name of the question or task that was scored."""
    phase: str | None = None
    """Part of the data, such as training or test; phases are never pooled."""
    step: str | None = None
    """Step of training at which the score was measured; the last one is compared."""

    @classmethod
    def of(
        cls, given: Mapping[str, str | Sequence[str] | None], known: Sequence[str]
    ) -> ScoreColumns:
        """Return the roles that are given; other roles are those of columns of the same name.

        Parameters
        ----------
        given
            Column by role, or several columns of conditions and scores.
        known
            The columns of the table.
        """
        several = {
            role: _several(given.get(role) or role, known) for role in ("condition", "score")
        }
        single = {role: given.get(role) for role in cls._fields[2:]}
        taken = {*chain(*several.values()), *single.values()}
        for role in single:
            if single[role] is None and role in known and role not in taken:
                single[role] = role
        return cls(**several, **single)  # type: ignore[arg-type]


def parse_roles(pairs: Sequence[str]) -> dict[str, str]:
    """Return the column of each role that ``ROLE=COLUMN`` names, with commas between pairs.

    Raises
    ------
    SpecError
        If a role is unknown or given twice.

    Examples
    --------
    >>> parse_roles(["condition=topology+model,score=right"])
    {'condition': 'topology+model', 'score': 'right'}
    """
    given: dict[str, str] = {}
    for pair in (part for text in pairs for part in text.split(",")):
        role, _, column = pair.partition("=")
        if role not in ScoreColumns._fields or not column or role in given:
            raise SpecError(
                f"columns = {pair!r}: must be ROLE=COLUMN, each role once: "
                f"{', '.join(ScoreColumns._fields)}"
            )
        given[role] = column
    return given


def _several(names: str | Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return the columns that a name or several names joined by ``+`` stand for."""
    if not isinstance(names, str):
        return tuple(names)
    return (names,) if names in known else tuple(names.split("+"))


class Foreign(NamedTuple):
    """Results of other tools, and what was left out or chosen when they were read."""

    outline: StudyOutline
    results: Results
    notes: tuple[str, ...]


def results_of(table: ScoreTable, columns: ScoreColumns, better: Better = "higher") -> Foreign:
    """Return the results of a table of scores.

    A condition without seeds, where other conditions have them, holds published figures. It is
    shown but not paired.

    Parameters
    ----------
    table
        A row for each score.
    columns
        The roles of its columns.
    better
        Which scores are better. Scores that are 0 or 1 throughout are rates.

    Raises
    ------
    SpecError
        If a column is missing, a score is no finite number, a row stands twice, or nothing is left.
    """
    _check_columns(table, columns)
    scores = pd.DataFrame({_own_name(name): table.numbers(name) for name in columns.score})
    notes = _blank_notes(scores)
    rows = np.flatnonzero(scores.notna().any(axis=1))
    if not len(rows):
        raise SpecError(f"score = {'+'.join(columns.score)!r}: no row has one")
    table = table.take(rows)
    levels = pd.DataFrame({name: table.filled(name) for name in columns.condition})
    frame = scores.iloc[rows].reset_index(drop=True).assign(**_keys(table, columns, levels))
    conditions = _conditions(frame["condition"], levels)
    notes += _pairing_notes(columns)
    _check_runs(table, frame, columns)
    if columns.step is not None:
        frame, aligned = at_last_step(frame, list(scores), columns.step)
        notes += aligned
    has_items = columns.seed is not None and columns.item is not None
    frame["seed"] = whole_names(frame["seed"])
    frame["episode"] = whole_names(frame["episode"]) if has_items else 0
    titles = zip(scores, columns.score, strict=True)
    measures = [_measure(name, title, frame, better) for name, title in titles]
    results = pack(frame, conditions, measures, pairs_episodes=has_items)
    outline = {"study": "learning-curve", "seeds": 1, "episodes": 0, "steps": 0, "evaluation": 1}
    return Foreign(StudyOutline.noted(outline, conditions), results, tuple(notes))


def _keys(table: ScoreTable, columns: ScoreColumns, levels: pd.DataFrame) -> dict[str, object]:
    """Return the columns of the long form that name a score."""
    item = table.text(columns.item) if columns.item else ""
    return {
        "condition": _labels(levels),
        "phase": table.filled(columns.phase) if columns.phase else PHASE,
        "step": _steps(table, columns.step) if columns.step else 0.0,
        "seed": table.text(columns.seed) if columns.seed else item,  # an item stands for a run
        "episode": item if columns.seed else "",
    }


def _pairing_notes(columns: ScoreColumns) -> list[str]:
    """Return remarks on how runs are paired."""
    if columns.seed is not None:
        return []
    if columns.item is not None:
        return [f"no column 'seed': a seed below is one value of {columns.item!r}"]
    return [
        "no column 'seed' or 'item': runs cannot be paired, independent samples are compared; "
        "--columns seed=COLUMN names the runs"
    ]


def _own_name(name: str) -> str:
    return f"{name} (own)" if name in RESERVED else name


def _check_columns(table: ScoreTable, columns: ScoreColumns) -> None:
    """Refuse roles of columns that the table does not have, or that are named twice."""
    roles = columns._asdict()
    wanted = [(role, name) for role in ("condition", "score") for name in roles.pop(role)]
    wanted += [(role, name) for role, name in roles.items() if name is not None]
    names = [name for _, name in wanted]
    for role, name in wanted:
        if name not in table.columns:
            hint = closest(name, table.columns)
            raise SpecError(f"columns: {role} = {name!r}: no such column; {hint}")
        if names.count(name) > 1:
            raise SpecError(f"columns: {role} = {name!r}: is named twice")


def _blank_notes(scores: pd.DataFrame) -> list[str]:
    """Return how many rows lack a score, by column, in lines."""
    blank = scores.isna().sum()
    return [
        f"{count} of {len(scores)} rows have no {name!r}: left out"
        for name, count in blank.items()
        if count
    ]


def _steps(table: ScoreTable, column: str) -> pd.Series:
    steps = table.numbers(column)
    blank = steps.isna().to_numpy()
    if blank.any():
        raise SpecError(f"{table.place(int(blank.argmax()))}: {column} is blank")
    return steps


def _labels(levels: pd.DataFrame) -> pd.Series:
    """Return the label of each row's condition; labels of different conditions differ."""
    if levels.shape[1] == 1:
        return levels.iloc[:, 0]
    labels = pd.Series([label(row) for row in levels.to_dict("records")], levels.index)
    known = levels.assign(**{LABEL: labels}).drop_duplicates()[LABEL]
    if known.duplicated().any():
        twice = known[known.duplicated()].iloc[0]
        raise SpecError(f"columns: condition: two conditions have the label {twice!r}")
    return labels


def _conditions(labels: pd.Series, levels: pd.DataFrame) -> dict[str, dict[str, object]]:
    """Return the levels of each condition, sorted by the labels of the conditions."""
    named = {_own_name(name): plain_levels(levels[name]) for name in levels if name != "condition"}
    rows = pd.DataFrame({LABEL: labels, **named}).drop_duplicates(LABEL).to_dict("records")
    known = {row.pop(LABEL): row for row in rows}
    return {condition: known[condition] for condition in sort_labels(known)}


def _check_runs(table: ScoreTable, frame: pd.DataFrame, columns: ScoreColumns) -> None:
    """Name the runs that have no name, and refuse rows that stand twice."""
    unnamed = (frame["seed"] == "").to_numpy()
    blank = pd.Series(unnamed).groupby(frame["condition"].to_numpy()).transform("mean").to_numpy()
    mixed = unnamed & (blank < 1.0)
    if mixed.any():
        row = int(mixed.argmax())
        condition = frame["condition"].iloc[row]
        column = columns.seed or columns.item
        raise SpecError(
            f"{table.place(row)}: {column} is blank, but other rows of condition {condition!r} "
            "have one"
        )
    if columns.item is not None and columns.seed is not None:
        is_blank = (frame["episode"] == "").to_numpy() & ~unnamed
        if is_blank.any():
            raise SpecError(f"{table.place(int(is_blank.argmax()))}: {columns.item} is blank")
    has_items = bool((frame["episode"] != "").any())
    if unnamed.any() and not has_items and columns.step is None:
        # The order of rows must not matter, so that runs are numbered in the order of their scores.
        keys = ["condition", "phase", *map(_own_name, columns.score)]
        order = frame[unnamed].sort_values(keys).index
        frame.loc[order, "seed"] = [f"{UNNAMED}{k}" for k in range(len(order))]
    elif unnamed.any():
        frame.loc[unnamed, "seed"] = UNNAMED + frame["condition"][unnamed]
    roles = {
        "condition": "+".join(columns.condition),
        "phase": columns.phase,
        "seed": columns.seed or columns.item,
        "episode": columns.item if columns.seed else None,
        "step": columns.step,
    }
    missing = [r for r, own in (("seed", columns.seed), ("item", columns.item)) if own is None]
    hint = f"; name the column that differs: --columns {missing[0]}=COLUMN" if missing else ""
    refuse_repeated(table, frame, roles, hint)


def _measure(name: str, title: str, frame: pd.DataFrame, better: Better) -> Measure:
    """Return the measure of a column of scores."""
    kind = score_kind(frame, name)
    if kind == "rate" and name == SUCCESS.name and better == "higher":
        return SUCCESS
    least, greatest = (0.0, 1.0) if kind else (None, None)
    is_rate = kind == "rate"
    return Measure(name, title, is_rate=is_rate, better=better, least=least, greatest=greatest)


def score_kind(frame: pd.DataFrame, name: str) -> Literal["rate", "share", ""]:
    """Tell whether scores are rates: 0 or 1, and as many in every run of a condition.

    Scores that are 0 or 1 are shares if runs have different numbers of them.
    """
    known = frame[frame[name].notna()]
    if not known[name].isin((0.0, 1.0)).all():
        return ""
    groups = known.groupby(["condition", "phase"], sort=False)
    sizes = groups.agg(rows=(name, "size"), seeds=("seed", "nunique"), items=("episode", "nunique"))
    return "rate" if (sizes["rows"] == sizes["seeds"] * sizes["items"]).all() else "share"
