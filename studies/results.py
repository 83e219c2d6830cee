"""The rows of a study as arrays: by condition, one row per seed and one column per episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .episodes import COLUMNS
from .store import Phase, Store

MEASURES = COLUMNS[2:]
"""The columns that hold a measurement."""

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Results:
    """What the finished trials of a study measured.

    Attributes
    ----------
    training, evaluation
        By condition, in the order of the spec, then by measure: arrays ``(n_seeds, n_episodes)``.
        Conditions without a finished trial are absent.
    """

    training: dict[str, Arrays]
    evaluation: dict[str, Arrays]


def read(store: Store) -> Results:
    """Read all that has finished."""
    return Results(_arrays(store, "training"), _arrays(store, "evaluation"))


def _arrays(store: Store, phase: Phase) -> dict[str, Arrays]:
    names, rows = store.rows(phase)
    at = {name: names.index(name) for name in ("condition", "seed", *MEASURES)}
    runs: dict[str, dict[int, list[tuple[Any, ...]]]] = {}
    for row in rows:
        runs.setdefault(row[at["condition"]], {}).setdefault(row[at["seed"]], []).append(row)
    return {
        condition: {
            name: np.array([[row[at[name]] for row in run] for run in by_seed.values()])
            for name in MEASURES
        }
        for condition, by_seed in runs.items()
    }
