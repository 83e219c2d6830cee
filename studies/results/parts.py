"""Parts of one study that were run into folders of their own, as a Slurm array does, put together.

Parts are of one study if their specs differ in their seeds alone, and no trial is in two of them.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from ...core.numerics import pd
from ..spec.outline import StudyOutline
from .long_form import name_key
from .results import Results, assemble

Part = tuple[StudyOutline, Results]
"""What a part consists of, and what it measured."""


def join_parts(parts: Sequence[Part]) -> Part | None:
    """Return the study that parts are of; None if they are parts of no one study.

    Rows are in the order in which the whole study has them, so that exported files are the same.
    """
    first, results = parts[0]
    if any(_without_seeds(outline) != _without_seeds(first) for outline, _ in parts):
        return None
    trials = pd.concat([part.trials[["condition", "seed"]] for _, part in parts])
    if trials.duplicated().any():
        return None
    place = {condition: i for i, condition in enumerate(results.columns)}
    joined = assemble(
        [_in_order([part.episodes for _, part in parts], place)],
        [_in_order([part.trials for _, part in parts], place)],
        dict.fromkeys(chain.from_iterable(part.phases for _, part in parts)),
        results.columns,
        results.measures,
        chain.from_iterable(part.usage for _, part in parts),
    )
    seeds = tuple(dict.fromkeys(chain.from_iterable(outline.seeds for outline, _ in parts)))
    table = {**first.table, "seeds": list(seeds)}
    joined = replace(joined, step_limits=results.step_limits, pairs_episodes=results.pairs_episodes)
    return first._replace(seeds=seeds, table=table), joined


def _without_seeds(outline: StudyOutline) -> object:
    own = {key: value for key, value in outline.table.items() if key != "seeds"}
    return own, outline.columns


def _in_order(frames: Sequence[pd.DataFrame], place: dict[str, int]) -> pd.DataFrame:
    """Return rows below each other, by condition and seed; what a trial has stays in its order."""
    whole = pd.concat(frames, ignore_index=True)
    keys = pd.DataFrame(
        {"place": whole["condition"].map(place), "seed": whole["seed"].map(name_key)}
    )
    order = keys.sort_values(["place", "seed"], kind="stable").index
    return whole.loc[order].reset_index(drop=True)
