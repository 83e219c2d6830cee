"""The rows of a study as arrays: by condition, one row per seed and one column per episode."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.interface.measures import SUCCESS, Measure
from ..store.schema import AFTER, ELSEWHERE
from ..store.store import Store

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Results:
    """What the finished trials of a study measured.

    Attributes
    ----------
    training, evaluation
        By condition, in the order of the spec, then by ``steps``, the name of a measure, or
        ``return``: arrays ``(n_seeds, n_episodes)``. Conditions without a finished trial are
        absent, and measures that a condition's scenario has not.
    phases
        The same of every phase by name, training and evaluation included.
    seeds
        By condition, the finished seeds, in the order of the arrays' rows.
    numbers
        By condition and name ``(n_seeds,)`` numbers of whole trials, see `TrialResult.numbers`.
    usage
        The same of what differs from run to run: ``decision``, ``learning`` and further parts [s]
        as in `TrialResult.seconds`, and `TrialResult.usage`.
    columns
        By condition, what tells it from the others, see
        `nested_agents.studies.spec.conditions.Condition`.
    measures
        What episodes are told by, of all conditions; success first.
    """

    training: dict[str, Arrays]
    evaluation: dict[str, Arrays]
    phases: dict[str, dict[str, Arrays]] = field(default_factory=dict)
    seeds: dict[str, tuple[int, ...]] = field(default_factory=dict)
    numbers: dict[str, Arrays] = field(default_factory=dict)
    usage: dict[str, Arrays] = field(default_factory=dict)
    columns: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    measures: tuple[Measure, ...] = (SUCCESS,)

    def elsewhere(self, condition: str) -> dict[str, Arrays]:
        """Return what the evaluations of a condition beside its own gave, by their names."""
        return {
            phase.removeprefix(ELSEWHERE): arrays[condition]
            for phase, arrays in self.phases.items()
            if phase.startswith(ELSEWHERE) and condition in arrays
        }


def read(store: Store) -> Results:
    """Read all that has finished."""
    names, timed = store.seconds()
    seconds = [
        (row[0], row[1], name, value)
        for row in timed
        for name, value in zip(names[2:], row[2:], strict=True)
    ]
    seeds: dict[str, list[int]] = {}
    for row in timed:
        seeds.setdefault(row[0], []).append(row[1])
    numbers = store.numbers()
    measures = store.measures()
    columns = ("steps", *(measure.name for measure in measures), *AFTER)
    phases = {phase: _arrays(store, phase, columns) for phase in store.phases()}
    return Results(
        phases.get("training", {}),
        phases.get("evaluation", {}),
        phases,
        {condition: tuple(found) for condition, found in seeds.items()},
        _by_name(row[:4] for row in numbers if row[4]),
        _by_name([*seconds, *(row[:4] for row in numbers if not row[4])]),
        store.columns(),
        measures,
    )


def _by_name(rows: Iterable[tuple[str, int, str, float]]) -> dict[str, Arrays]:
    found: dict[str, dict[str, list[float]]] = {}
    for condition, _, name, value in rows:
        found.setdefault(condition, {}).setdefault(name, []).append(value)
    return {
        condition: {name: np.array(values) for name, values in by_name.items()}
        for condition, by_name in found.items()
    }


def _arrays(store: Store, phase: str, columns: Sequence[str]) -> dict[str, Arrays]:
    names, rows = store.rows(phase)
    condition, seed = names.index("condition"), names.index("seed")
    runs: dict[str, dict[int, list[tuple[Any, ...]]]] = {}
    for row in rows:
        runs.setdefault(row[condition], {}).setdefault(row[seed], []).append(row)
    at = {name: names.index(name) for name in columns}
    return {
        condition: {
            name: np.array([[row[i] for row in run] for run in by_seed.values()])
            for name, i in at.items()
            if all(row[i] is not None for run in by_seed.values() for row in run)
        }
        for condition, by_seed in runs.items()
    }
