"""Results of other tools, read from a table of scores.

A row is one score of a condition: of a run (its seed), on an item (a question, a task, an episode),
or both; in a phase, and at a step of training. Runs and items are paired by name. A table that
names neither holds independent samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from ...core.numerics import pd
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.tables import label
from .score_tables import ScoreTable
from .scores import (
    KEYS,
    UNNAMED,
    Better,
    ScoreResults,
    alike_note,
    at_last_step,
    joined_notes,
    measure_of,
    plain_levels,
    refuse_repeated,
    results_of,
    sort_labels,
    whole_names,
)

PHASE = "evaluation"
"""Phase of the scores of a table that names none."""
RESERVED = ("condition", "seed", "phase", "episode", "step", "steps", "return", "state")
"""Names of columns of results; columns of a table with these names get other ones."""
UNPAIRED = (
    "no column 'seed' or 'item': runs cannot be paired, independent samples are compared; "
    "--columns seed=COLUMN names the runs"
)


ROLES = ("condition", "score", "seed", "item", "phase", "step")
"""Roles of columns: the compared conditions, of which several columns are crossed; scores, each a
measure; the name of the run; the question or task that was scored; the part of the data, such as
training or test, which is never pooled; the step of training, of which the last is compared."""
ScoreColumns = dict[str, tuple[str, ...]]
"""Columns of a table by role; at most one of each role but condition and score."""


def columns_by_role(
    given: Mapping[str, str | Sequence[str] | None], known: Sequence[str]
) -> ScoreColumns:
    """Return the columns of all roles: those that are given, or those called as the role.

    Parameters
    ----------
    given
        Column by role, or several columns of conditions and scores.
    known
        The columns of the table.

    Raises
    ------
    SpecError
        If the table lacks a column, or a column has two roles.
    """
    columns = {role: _several(given.get(role) or role, known) for role in ROLES[:2]}
    columns |= {role: (str(given[role]),) if given.get(role) else () for role in ROLES[2:]}
    taken = {*chain(*columns.values())}
    columns |= {r: (r,) for r in ROLES[2:] if not columns[r] and r in known and r not in taken}
    names = [*chain(*columns.values())]
    for role, own in columns.items():
        for name in own:
            if name not in known:
                hint = closest(name, known)
                raise SpecError(f"columns: {role} = {name!r}: no such column; {hint}")
            if names.count(name) > 1:
                raise SpecError(f"columns: {role} = {name!r}: is named twice")
    return columns


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
        if role not in ROLES or not column or role in given:
            raise SpecError(
                f"columns = {pair!r}: must be ROLE=COLUMN, each role once: {', '.join(ROLES)}"
            )
        given[role] = column
    return given


def _several(names: str | Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return the columns that a name or several names joined by ``+`` stand for."""
    if not isinstance(names, str):
        return tuple(names)
    return (names,) if names in known else tuple(names.split("+"))


def read_scores(
    table: ScoreTable, columns: ScoreColumns, better: Better = "higher"
) -> ScoreResults:
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
        If a score is no finite number, a name is blank, a row stands twice, or nothing is left.
    """
    run, item, _, step = (next(iter(columns[role]), None) for role in ROLES[2:])
    titles = {_own_name(name): name for name in columns["score"]}
    values = pd.DataFrame({name: table.numbers(title) for name, title in titles.items()})
    has_score = values.notna().any(axis=1).to_numpy()
    if not has_score.any():
        raise SpecError(f"score = {'+'.join(columns['score'])!r}: no row has one")
    notes = [
        f"{count} of {len(values)} rows have no {name!r}: left out"
        for name, count in values.isna().sum().items()
        if count
    ]
    table = table.take(np.flatnonzero(has_score))
    levels = pd.DataFrame({name: table.names(name) for name in columns["condition"]})
    scores = values[has_score].reset_index(drop=True).assign(condition=_labels(levels))
    conditions = _conditions(scores["condition"], levels)
    scores = _named(table, columns, scores)
    for name in levels:
        notes += alike_note(str(name), levels[name])
    for name in filter(None, (run, item)):
        notes += alike_note(name, table.text(name), are_runs=True)
    if run is None:
        one_value = f"no column 'seed': a seed below is one value of {item!r}"
        notes.append(one_value if item else UNPAIRED)
    if step is not None:
        scores, aligned = _at_last_step(scores, list(titles), step)
        notes += aligned
    has_items = run is not None and item is not None
    scores["seed"] = whole_names(scores["seed"])
    scores["episode"] = whole_names(scores["episode"]) if has_items else 0
    measures = [measure_of(scores, name, title, better) for name, title in titles.items()]
    results = results_of(scores, conditions, measures, pairs_episodes=has_items)
    return ScoreResults(results, tuple(notes))


def _own_name(name: str) -> str:
    return f"{name} (own)" if name in RESERVED else name


def _named(table: ScoreTable, columns: ScoreColumns, scores: pd.DataFrame) -> pd.DataFrame:
    """Return scores with phase, step, run and item; rows that stand twice are refused.

    Items stand for runs without names. Runs without any name are numbered in the order of their
    scores, because the order of rows must not matter.
    """
    condition = scores["condition"]
    seed, item, phase, step = (next(iter(columns[role]), None) for role in ROLES[2:])
    run, item = (seed, item) if seed else (item, None)
    blank = pd.Series("", scores.index)
    runs = table.text(run) if run else blank
    items = table.text(item) if item else blank
    is_unnamed = runs == ""
    if run is not None:
        is_mixed = is_unnamed & ~is_unnamed.groupby(condition).transform("all")
        table.refuse(is_mixed, run, ", but other rows of its condition have one")
    if item is not None:
        table.refuse((items == "") & ~is_unnamed, item, "")
    named = scores.assign(
        phase=table.names(phase) if phase else PHASE,
        step=_steps(table, step) if step else 0.0,
        seed=runs.mask(is_unnamed, UNNAMED + condition),
        episode=items,
    )
    if step is None and (items == "").all():
        order = named[is_unnamed].sort_values(
            ["condition", "phase", *map(_own_name, columns["score"])]
        )
        named.loc[order.index, "seed"] = [f"{UNNAMED}{k}" for k in range(len(order))]
    roles = dict(
        zip(
            ("condition", "phase", "seed", "episode", "step"),
            ("+".join(columns["condition"]), phase, run, item, step),
            strict=True,
        )
    )
    missing = [role for role in ("seed", "item") if not columns[role]]
    hint = f"; name the column that differs: --columns {missing[0]}=COLUMN" if missing else ""
    refuse_repeated(table, named, roles, hint)
    return named


def _steps(table: ScoreTable, column: str) -> pd.Series:
    steps = table.numbers(column)
    table.refuse(steps.isna(), column, "")
    return steps


def _at_last_step(
    scores: pd.DataFrame, measures: Sequence[str], step_name: str
) -> tuple[pd.DataFrame, list[str]]:
    """Return the scores of each phase and measure at their last common step, and notes on them.

    Raises
    ------
    SpecError
        If a measure has no step that is common to the conditions.
    """
    keys = scores[[*KEYS, "step"]]
    kept = []
    notes = []
    for name in measures:
        known = keys.assign(measure=name, value=scores[name]).dropna()
        for phase, own in known.groupby("phase"):
            rows, note = at_last_step(own, step_name)
            if rows.empty:
                raise SpecError(f"{name}: {note}")
            kept.append(rows)
            is_only = scores["phase"].nunique() == 1
            notes.append((name if is_only else f"{name}, {phase}", note))
    whole = pd.concat(kept).pivot(index=KEYS, columns="measure", values="value").reset_index()
    return whole, joined_notes(notes)


def _labels(levels: pd.DataFrame) -> pd.Series:
    """Return the label of each row's condition; labels of different conditions differ."""
    if levels.shape[1] == 1:
        return levels.iloc[:, 0]
    labels = pd.Series([label(row) for row in levels.to_dict("records")], levels.index)
    known = labels[~levels.duplicated()]
    if known.duplicated().any():
        twice = known[known.duplicated()].iloc[0]
        raise SpecError(f"columns: condition: two conditions have the label {twice!r}")
    return labels


def _conditions(labels: pd.Series, levels: pd.DataFrame) -> dict[str, dict[str, object]]:
    """Return the levels of each condition, sorted by the labels of the conditions."""
    named = {_own_name(name): plain_levels(levels[name]) for name in levels if name != "condition"}
    is_first = ~labels.duplicated()
    rows = pd.DataFrame(named, labels.index)[is_first].to_dict("records")
    known = dict(zip(labels[is_first], rows, strict=True))
    return {condition: known[condition] for condition in sort_labels(known)}
