"""Scores in long form: a row for each condition, phase, seed and episode, sorted by name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from ...core.interface.measures import Measure
from ...core.numerics import pd
from ..errors import SpecError
from ..spec.tables import SpecTable
from .results import DONE, Results, assemble
from .score_files import NUMBER, ScoreTable

KEYS = ["condition", "phase", "seed", "episode"]
"""Columns that name a score."""
WHOLE = re.compile(r"0|[1-9][0-9]{0,17}", re.ASCII)
"""A whole number in its one usual spelling."""
UNNAMED = "unnamed run "
"""Prefix of the names of runs that have none."""


def whole_names(names: pd.Series) -> pd.Series:
    """Return names as whole numbers if all of them are such; runs without a name stay text.

    >>> whole_names(pd.Series(["7", "12"])).tolist(), whole_names(pd.Series(["7", "07"])).tolist()
    ([7, 12], ['7', '07'])
    """
    known = [name for name in names.unique() if not name.startswith(UNNAMED)]
    if not known or not all(map(WHOLE.fullmatch, known)):
        return names
    numbers: dict[str, object] = {name: int(name) for name in known}
    return pd.Series([numbers.get(name, name) for name in names], names.index)


def name_key(name: object) -> tuple[bool, int, object]:
    """Return the key by which names are sorted: whole numbers first, then text by its length."""
    return (True, len(name), name) if isinstance(name, str) else (False, 0, name)


def sort_labels(labels: Iterable[str]) -> list[str]:
    """Return labels sorted by size if all are numbers, else by their text.

    >>> sort_labels(["16", "2", "4"]), sort_labels(["star", "chain", "2"])
    (['2', '4', '16'], ['2', 'chain', 'star'])
    """
    known = list(labels)
    are_numbers = all(NUMBER.fullmatch(text) for text in known)
    return sorted(known, key=lambda text: (float(text) if are_numbers else 0.0, text))


def plain_levels(levels: pd.Series) -> pd.Series:
    """Return the levels of a swept key as numbers if all are, and are spelled as numbers are.

    >>> plain_levels(pd.Series(["2", "16"])).tolist(), plain_levels(pd.Series(["3.10"])).tolist()
    ([2, 16], ['3.10'])
    """
    numbers: dict[str, int | float] = {}
    for text in levels.unique():
        if not NUMBER.fullmatch(text):
            return levels
        number = int(text) if WHOLE.fullmatch(text) else float(text)
        if str(number) != text:
            return levels
        numbers[text] = number
    return levels.map(numbers)


def pack(
    frame: pd.DataFrame,
    conditions: Mapping[str, SpecTable],
    measures: Sequence[Measure],
    *,
    pairs_episodes: bool = False,
) -> Results:
    """Return scores in long form as results.

    Parameters
    ----------
    frame
        Has the columns `KEYS`, and a column for each measure.
    conditions
        Swept keys by condition, in the order of the conditions.
    measures
        What is measured, besides steps and returns.
    pairs_episodes
        Whether conditions are compared on the episodes that both have.
    """
    place = {condition: k for k, condition in enumerate(conditions)}
    order = pd.DataFrame(
        {
            "condition": frame["condition"].map(place),
            "phase": frame["phase"],
            "seed": frame["seed"].map(name_key),
            "episode": frame["episode"].map(name_key),
        }
    )
    frame = frame.loc[order.sort_values(KEYS).index].reset_index(drop=True)
    keys = dict.fromkeys(key for own in conditions.values() for key in own)
    swept = {k: [conditions[c].get(k, "") for c in frame["condition"]] for k in keys}
    frame = frame.assign(**swept)
    trials = frame[["condition", *keys, "seed"]].drop_duplicates(["condition", "seed"])
    phases = sorted(frame["phase"].unique(), key=_phase_key)
    whole = assemble([frame], [trials.assign(state=DONE)], phases, conditions, tuple(measures), ())
    return replace(whole, pairs_episodes=pairs_episodes)


def refuse_repeated(
    table: ScoreTable, frame: pd.DataFrame, columns: Mapping[str, str | None], hint: str = ""
) -> None:
    """Raise `SpecError` if two rows name the same score.

    Parameters
    ----------
    table
        The table that the rows are of.
    frame
        The rows in long form.
    columns
        Columns that name a score, and what they are called in the table.
    hint
        What the message ends with.
    """
    keys = list(columns)
    repeated = frame.duplicated(keys).to_numpy()
    if not repeated.any():
        return
    row = int(repeated.argmax())
    first = int((frame[keys] == frame[keys].iloc[row]).all(axis=1).to_numpy().argmax())
    named = ", ".join(
        f"{name} = {_shown(frame[k].iloc[row])}" for k, name in columns.items() if name
    )
    raise SpecError(f"{table.place(row)}: {named}: stands in {table.place(first)}, too{hint}")


def _shown(name: object) -> str:
    """Return a name, text in quotes."""
    return repr(name) if isinstance(name, str) else f"{name}"


def _phase_key(phase: str) -> tuple[int, str]:
    """Return the place of a phase: training first, then evaluation, then others."""
    usual = ("training", "evaluation")
    return (usual.index(phase) if phase in usual else len(usual), phase)
