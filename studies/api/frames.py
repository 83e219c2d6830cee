"""Rows of studies as pandas data frames, their columns with units and meaning.

pandas is in the extra ``nested-agents[pandas]``; nothing else needs it. What a column is stands in
``frame.attrs["columns"]``, by name: its unit and what it means.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.interface.measures import Measure
from ..errors import SpecError
from ..results.numbers import NUMBERS
from ..store.reading import NamesAndRows
from ..store.store import Store

if TYPE_CHECKING:
    from pandas import DataFrame

EPISODE_COLUMNS = {
    "condition": ("", "label of the condition"),
    "seed": ("1", "seed of the trial"),
    "phase": ("", "training, evaluation, training:STAGE or evaluation:NAME"),
    "episode": ("1", "number of the episode in its phase, from 0"),
    "steps": ("1", "decisions until the episode ended"),
    "return": ("1", "sum of the rewards, not discounted; mean over agents"),
}
"""Units and meaning of the columns of episodes that every scenario has."""
TRIAL_COLUMNS = {
    "condition": ("", "label of the condition"),
    "seed": ("1", "seed of the trial"),
    "state": ("", "done or failed"),
    "identity": ("", "hash of all that the trial consists of"),
    "error": ("", "last line of the traceback, if it failed"),
}
"""The same of trials."""


class Part(NamedTuple):
    """Where rows are from."""

    directory: Path
    """Of a study."""
    labels: Mapping[str, str]
    """What its conditions are called here, by their own labels."""


Keep = Callable[[str, int], bool]
"""Tells of a condition, as it is called here, and a seed whether its rows are wanted."""


def trials(parts: Iterable[Part], keep: Keep) -> DataFrame:
    """Return one row per trial; those that have failed included."""
    frame, _ = _frame(parts, lambda store: store.trials(), keep)
    told = {name: ("", "a swept key") for name in frame.columns}
    told |= {n: ("s", "time spent") for n in frame.columns if n.startswith("seconds.")}
    told |= {n: tuple(NUMBERS[n]) for n in frame.columns if n in NUMBERS}
    frame.attrs["columns"] = _told(frame.columns, told | TRIAL_COLUMNS)
    return frame


def episodes(parts: Iterable[Part], keep: Keep) -> DataFrame:
    """Return one row per episode of every finished trial; episodes are counted from 0."""
    frame, measures = _frame(parts, lambda store: store.episodes(), keep)
    for measure in measures:
        if measure.is_rate and frame[measure.name].notna().all():
            frame[measure.name] = frame[measure.name].astype(bool)
    told = {name: ("", "a swept key") for name in frame.columns}
    told |= {m.name: (m.unit, f"{m.title}, {m.gathering} of its steps") for m in measures}
    frame.attrs["columns"] = _told(frame.columns, told | EPISODE_COLUMNS)
    return frame


def _frame(
    parts: Iterable[Part], rows_of: Callable[[Store], NamesAndRows], keep: Keep
) -> tuple[DataFrame, list[Measure]]:
    pandas = _pandas()
    frames: list[Any] = []
    measures: dict[str, Measure] = {}
    for part in parts:
        with Store.open(part.directory) as store:
            store.verify()
            names, rows = rows_of(store)
            frame = pandas.DataFrame(list(rows), columns=names)
            measures |= {m.name: m for m in store.measures()}
        frame["condition"] = [part.labels[c] for c in frame["condition"]]
        pairs = zip(frame["condition"], frame["seed"], strict=True)
        frames.append(frame[[keep(condition, seed) for condition, seed in pairs]])
    whole = frames[0] if len(frames) == 1 else pandas.concat(frames)
    return whole.reset_index(drop=True).drop(columns="position", errors="ignore"), [
        *measures.values()
    ]


def _told(names: Sequence[str], known: Mapping[str, tuple[str, str]]) -> dict[str, dict[str, str]]:
    return {n: dict(zip(("unit", "meaning"), known[n], strict=True)) for n in names}


def _pandas() -> Any:
    try:
        import pandas
    except ModuleNotFoundError:
        raise SpecError(
            "data frames: pandas is not installed; pip install 'nested-agents[pandas]'"
        ) from None
    return pandas
