"""Series of scores aligned by step: which step is compared, and which runs are too short."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

from ...core.numerics import pd
from ..errors import SpecError

NAMED_RUNS = 3
"""Largest number of runs that a note lists by name."""
LAST_STEP = "last step"
"""Phase of the scores at the last common step, where a file has other phases, too."""
LAST = ["condition", "seed", "phase", "episode"]


def last_common_step(frame: pd.DataFrame) -> float | None:
    """Return the largest step at which more than half of the runs of every condition have a score.

    Parameters
    ----------
    frame
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
    runs = frame.groupby("condition")["seed"].nunique()
    reached = frame.groupby(["step", "condition"])["seed"].nunique().unstack()
    is_common = (reached.reindex(columns=runs.index).fillna(0) * 2 > runs).all(axis=1)
    steps = is_common.index[is_common]
    return float(steps.max()) if len(steps) else None


def at_last_step(
    frame: pd.DataFrame, measures: Iterable[str], column: str
) -> tuple[pd.DataFrame, list[str]]:
    """Return the scores of the last common step of each phase and measure, and notes on them.

    Parameters
    ----------
    frame
        Scores in long form, with a column for each measure.
    measures
        Columns of the measures.
    column
        What a step is called in notes.

    Raises
    ------
    SpecError
        If no step is common to the conditions.
    """
    kept = []
    notes: dict[str, list[str]] = {}
    for phase, measure in product(sorted(frame["phase"].unique()), measures):
        own = frame[(frame["phase"] == phase) & frame[measure].notna()]
        if own.empty:
            continue
        step = last_common_step(own)
        if step is None:
            ends = own.groupby("condition")["step"].max().to_dict()
            ends_text = ", ".join(f"{condition} ends at {end:g}" for condition, end in ends.items())
            raise SpecError(
                f"{column}: most runs of every condition share no step with {measure}: {ends_text}"
            )
        rows = own[own["step"] == step]
        kept.append(rows[LAST].assign(measure=measure, value=rows[measure]))
        notes.setdefault(step_note(own, rows, f"{column} {step:.15g}"), []).append(measure)
    whole = pd.concat(kept).pivot(index=LAST, columns="measure", values="value").reset_index()
    return whole, [f"{', '.join(dict.fromkeys(names))}: {text}" for text, names in notes.items()]


def step_note(every: pd.DataFrame, rows: pd.DataFrame, where: str) -> str:
    """Return which step is compared, and how many runs have no score there."""
    text = f"compared at {where}, the last that most runs of every condition have"
    return text + left_out_note(every, rows)


def left_out_note(every: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Return how many runs of all are left out of some rows; nothing if none is."""
    runs = every[["condition", "seed"]].drop_duplicates()
    index = pd.MultiIndex.from_frame(runs)
    short = index[~index.isin(pd.MultiIndex.from_frame(rows[["condition", "seed"]]))]
    if not len(short):
        return ""
    names = [f"{condition}, {seed}" for condition, seed in sorted(short, key=str)[:NAMED_RUNS]]
    listed = "; ".join(names) + "; ..." * (len(short) > NAMED_RUNS)
    return f"; {len(short)} of {len(runs)} runs lack it and are left out ({listed})"
