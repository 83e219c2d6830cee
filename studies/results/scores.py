"""Scores of any file in one frame, and their results.

A frame of scores has a row for each condition, phase, seed (the run) and episode (the item), and a
column for each measure. Runs and items are paired by name.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Literal, NamedTuple

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import pd
from ...core.plugins.words import show
from ..errors import SpecError
from ..spec.tables import SpecTable
from .results import DONE, Results, assemble
from .score_tables import NUMBER, ScoreTable

KEYS = ["condition", "phase", "seed", "episode"]
"""Columns that name a score."""
PHASES = ("training", "evaluation")
"""Phases that come before all others. A file in the form of marl-eval can hold these only."""
LAST_STEP = "last step"
"""Phase of the scores at the last common step, where a file has other phases, too."""
NAMED_RUNS = 3
"""Largest number of runs that a note lists by name."""
WHOLE = re.compile(r"0|[1-9][0-9]{0,17}", re.ASCII)
"""A whole number in its one usual spelling."""
NUMBERS_WITHIN = re.compile(r"((?:(?<!\w)[+-])?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)", re.ASCII)
"""Numbers within a label; a hyphen after a letter or a digit is no sign."""
UNNAMED = "unnamed run "
"""Prefix of the names of runs that have none."""
Better = Literal["higher", "lower"]


class ScoreResults(NamedTuple):
    """Results of a file of scores."""

    results: Results
    notes: tuple[str, ...] = ()
    """Remarks on what was left out or chosen."""
    by: str | None = None
    """Key by which conditions are compared by default."""


def whole_names(names: pd.Series) -> pd.Series:
    """Return names as whole numbers if all of them are such; runs without a name stay text.

    >>> whole_names(pd.Series(["7", "12"])).tolist(), whole_names(pd.Series(["7", "07"])).tolist()
    ([7, 12], ['7', '07'])
    """
    numbers = {n: int(n) if WHOLE.fullmatch(n) else n for n in names.unique()}
    are_whole = all(isinstance(numbers[n], int) or n.startswith(UNNAMED) for n in numbers)
    return names.map(numbers) if are_whole else names


def name_key(name: object) -> tuple[bool, int, object]:
    """Return the key by which names are sorted: whole numbers first, then text by its length."""
    return (True, len(name), name) if isinstance(name, str) else (False, 0, name)


def sort_labels(labels: Iterable[str]) -> list[str]:
    """Return labels sorted by their text, in which numbers are sorted by size.

    >>> sort_labels(["carts=16", "carts=2"]), sort_labels(["star", "0.5", "-1", "chain"])
    (['carts=2', 'carts=16'], ['-1', '0.5', 'chain', 'star'])
    """
    return sorted(labels, key=lambda label: (_parts(label), label))


def _parts(label: str) -> list[tuple[bool, float, str]]:
    """Return the numbers of a label and the text between them."""
    parts = enumerate(NUMBERS_WITHIN.split(label))
    return [(False, float(p), "") if k % 2 else (True, 0.0, p) for k, p in parts if p]


def plain_levels(levels: pd.Series) -> pd.Series:
    """Return the levels of a swept key as numbers if all are, and are spelled as numbers are.

    >>> plain_levels(pd.Series(["2", "16"])).tolist(), plain_levels(pd.Series(["3.10"])).tolist()
    ([2, 16], ['3.10'])
    """
    numbers = {
        text: int(text) if WHOLE.fullmatch(text) else float(text)
        for text in levels.unique()
        if NUMBER.fullmatch(text)
    }
    are_plain = all(str(numbers.get(text)) == text for text in levels.unique())
    return levels.map(numbers) if are_plain else levels


def alike_note(column: str, names: pd.Series, *, are_runs: bool = False) -> list[str]:
    """Return a note on two names of a column that a reader would take for the same, if any.

    They differ in white space, in the encoding of a character or, for runs, in the spelling of a
    number. The note does not depend on the order of the names.

    >>> alike_note("seed", pd.Series(["7", "07"]), are_runs=True)
    ["seed: '7' and '07' look alike, but are different names"]
    """
    known: dict[object, str] = {}
    for name in sorted(names.unique(), key=lambda name: (len(name), name)):
        key: object = unicodedata.normalize("NFKC", name).strip()
        if are_runs and NUMBER.fullmatch(str(key)):
            key = Decimal(str(key))
        first = known.setdefault(key, name)
        if first != name:
            pair = f"{first!a} and {name!a}"
            return [f"{column}: {pair} look alike, but are different names"]
    return []


def refuse_repeated(
    table: ScoreTable, scores: pd.DataFrame, columns: Mapping[str, str | None], hint: str = ""
) -> None:
    """Raise `SpecError` if two rows name the same score.

    Parameters
    ----------
    table
        The table that the rows are of.
    scores
        Its frame of scores.
    columns
        Columns that name a score, and what they are called in the table.
    hint
        What the message ends with.
    """
    keys = scores[list(columns)]
    repeated = keys.duplicated().to_numpy()
    if not repeated.any():
        return
    row = int(repeated.argmax())
    first = int((keys == keys.iloc[row]).all(axis=1).to_numpy().argmax())
    named = ", ".join(f"{name} = {show(keys[k].iloc[row])}" for k, name in columns.items() if name)
    raise SpecError(f"{table.places[row]}: {named}: stands in {table.places[first]}, too{hint}")


def last_common_step(scores: pd.DataFrame) -> float | None:
    """Return the largest step at which more than half of the runs of every condition have a score.

    Parameters
    ----------
    scores
        A row for each score, with the columns condition, seed and step.

    Returns
    -------
    float or None
        The step; None if there is no such step.

    Examples
    --------
    >>> rows = [("a", 0, 1), ("a", 0, 2), ("a", 1, 1), ("a", 1, 2), ("b", 0, 1), ("b", 0, 2)]
    >>> last_common_step(pd.DataFrame([*rows, ("b", 0, 3)], columns=["condition", "seed", "step"]))
    2.0
    """
    runs = scores.groupby("condition")["seed"].nunique()
    reached = scores.groupby(["step", "condition"])["seed"].nunique().unstack(fill_value=0)
    is_common = (reached.reindex(columns=runs.index) * 2 > runs).all(axis=1)
    steps = is_common.index[is_common]
    return float(steps.max()) if len(steps) else None


def at_last_step(scores: pd.DataFrame, step_name: str) -> tuple[pd.DataFrame, str]:
    """Return the scores of a measure at the `last_common_step`, or none, with a note.

    Parameters
    ----------
    scores
        A row for each score of the measure in one phase, with the columns condition, seed and step.
    step_name
        Name of a step in the note.
    """
    step = last_common_step(scores)
    if step is None:
        ends = scores.groupby("condition")["step"].max()
        shown = ", ".join(f"{condition} ends at {end:g}" for condition, end in ends.items())
        note = f"most runs of every condition share no {step_name} ({shown}): not compared"
        return scores.iloc[:0], note
    rows = scores[scores["step"] == step]
    note = f"compared at {step_name} {step:.15g}, the last that most runs of every condition have"
    return rows, note + left_out_note(scores, rows)


def left_out_note(every: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Return how many runs of all are left out of some rows; nothing if none is."""
    runs, kept = (
        pd.MultiIndex.from_frame(own[["condition", "seed"]]).unique() for own in (every, rows)
    )
    short = sorted(runs.difference(kept, sort=False), key=str)
    if not short:
        return ""
    listed = "; ".join(f"{condition}, {seed}" for condition, seed in short[:NAMED_RUNS])
    listed += "; ..." * (len(short) > NAMED_RUNS)
    return f"; {len(short)} of {len(runs)} runs lack it and are left out ({listed})"


def joined_notes(notes: Iterable[tuple[str, str]]) -> list[str]:
    """Return notes on measures, equal ones as one.

    >>> joined_notes([("a", "is left out"), ("b", "is left out"), ("a", "is left out")])
    ['a, b: is left out']
    """
    names: dict[str, dict[str, None]] = {}
    for name, text in notes:
        names.setdefault(text, {})[name] = None
    return [f"{', '.join(own)}: {text}" for text, own in names.items()]


def measure_of(scores: pd.DataFrame, name: str, title: str, better: Better | None) -> Measure:
    """Return the measure of a column of scores.

    Scores of 0 and 1 are rates if the runs of a condition have equally many of them, else shares.
    """
    known = scores[scores[name].notna()]
    if not known[name].isin((0.0, 1.0)).all():
        return Measure(name, title, better=better)
    groups = known.groupby(["condition", "phase"])
    counts = groups[["seed", "episode"]].nunique().prod(axis=1)
    is_rate = bool((groups.size() == counts).all())
    if is_rate and name == SUCCESS.name and better == "higher":
        return SUCCESS
    return Measure(name, title, is_rate=is_rate, better=better, least=0.0, greatest=1.0)


def results_of(
    scores: pd.DataFrame,
    conditions: Mapping[str, SpecTable],
    measures: Sequence[Measure],
    *,
    pairs_episodes: bool = False,
) -> Results:
    """Return the results of a frame of scores.

    Parameters
    ----------
    scores
        Has the columns `KEYS`, and a column for each measure.
    conditions
        Swept keys by condition, in the order of the conditions.
    measures
        What is measured, besides steps and returns.
    pairs_episodes
        Whether conditions are compared on the episodes that both have.
    """
    phases = sorted(scores["phase"].unique(), key=lambda p: (p not in PHASES, p == PHASES[1], p))
    order = pd.DataFrame(
        {
            "condition": scores["condition"].map({c: k for k, c in enumerate(conditions)}),
            "phase": scores["phase"],
            "seed": scores["seed"].map(name_key),
            "episode": scores["episode"].map(name_key),
        }
    ).sort_values(KEYS)
    keys = dict.fromkeys(key for own in conditions.values() for key in own)
    scores = scores.loc[order.index].reset_index(drop=True)
    swept = {k: [conditions[c].get(k, "") for c in scores["condition"]] for k in keys}
    scores = scores.assign(**swept)
    trials = scores[["condition", *keys, "seed"]].drop_duplicates(["condition", "seed"])
    whole = assemble([scores], [trials.assign(state=DONE)], phases, conditions, tuple(measures), ())
    return replace(whole, pairs_episodes=pairs_episodes)
