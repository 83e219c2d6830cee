"""Results of a study as two tidy frames: episodes and trials.

Tables, comparisons, figures, reports and exported files are functions of these frames. Units and
meanings of the columns are in ``frame.attrs["columns"]`` by name.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.interface.measures import RETURN, SUCCESS, Measure, main_measure
from ...core.numerics import pd
from ..spec.tables import SpecTable
from ..store.database import EVALUATION
from ..store.store import Store

Array = NDArray[Any]

SECONDS = "seconds."
"""Prefix of the columns that hold the seconds of a trial's parts."""
CPU = "cpu."
"""Prefix of CPU seconds of training; the number of episodes or decisions until then follows."""
DONE = "done"
"""State of a trial that has finished."""
KEPT = "weights kept"
"""Phase of a copied team that keeps the weights it had when the failure began."""
STEPS = Measure("steps", "steps", least=0.0)
"""Length of an episode [decisions]. Neither is better: failed episodes may end early or late."""
StepLimits = tuple[int | None, int | None]
"""Longest episode of training and of evaluation [steps]; None where it is not known."""


def step_limits(spec: SpecTable) -> StepLimits:
    """Return the limits that a spec sets.

    >>> step_limits({"steps": 450}), step_limits({"steps": 90, "evaluation_steps": 150})
    ((450, 450), (90, 150))
    """
    steps = spec.get("steps")
    return steps, spec.get("evaluation_steps") or steps


@dataclass(frozen=True, eq=False)
class Results:
    """The frames of a study, or of several together, and arrays of what they hold."""

    episodes: pd.DataFrame
    """A row for each episode of the finished trials, by condition in the order of the spec, seed,
    phase and number of the episode; a column for each swept key and measure."""
    trials: pd.DataFrame
    """A row for each trial, failed ones included: its state, the seconds of its parts, and the
    numbers of `TrialResult.numbers` and `TrialResult.usage` by their names."""
    phases: tuple[str, ...] = ()
    """The phases of the episodes: training, evaluation, then others."""
    columns: Mapping[str, SpecTable] = field(default_factory=dict)
    """Swept keys with their values by condition, see
    `nested_agents.studies.spec.conditions.Condition`."""
    measures: tuple[Measure, ...] = (SUCCESS,)
    """Measures of episodes of any condition, success first."""
    usage: tuple[str, ...] = ()
    """Names of the numbers that differ from run to run, times first."""
    pairs_episodes: bool = False
    """Whether conditions are compared on the episodes that both have, such as questions."""
    step_limits: StepLimits = (None, None)
    same_conditions: tuple[tuple[str, ...], ...] | None = None
    """Groups of identical conditions where only a part of what was measured is kept."""

    def steps(self, phase: str) -> Measure:
        """Return the measure of the length of episodes, which ends at the longest allowed."""
        is_training = phase.partition(":")[0] in ("training", KEPT)
        return replace(STEPS, greatest=self.step_limits[0 if is_training else 1])

    @cached_property
    def conditions(self) -> tuple[str, ...]:
        """Labels of the conditions of which any trial has finished."""
        return tuple(self._finished)

    def seeds(self, condition: str) -> tuple[int, ...]:
        """Return the finished seeds of a condition, in the order of the rows of its arrays."""
        return tuple(self._finished[condition]["seed"].tolist()) if self.has(condition) else ()

    def numbers(self, condition: str) -> dict[str, Array]:
        """Return the numbers of whole trials that a condition has, ``(n_seeds,)`` by name."""
        own = self._finished[condition]
        others = {*TRIAL_COLUMNS, *self.columns.get(condition, ())}
        return {name: values.copy() for name, values in own.items() if name not in others}

    def has(self, condition: str, phase: str = "", measure: str = "") -> bool:
        """Return whether a condition has finished trials, episodes of a phase, or a measure."""
        rows = self._rows.get((phase, condition))
        if rows is None or not measure:
            return rows is not None if phase else condition in self._finished
        return measure in self._measured and not np.isnan(self._measured[measure][rows]).any()

    def has_any(self, condition: str, phase: str, measure: str) -> bool:
        """Return whether any episode of a phase has a measure."""
        rows = self._rows.get((phase, condition), np.empty(0, int))
        values = self._measured.get(measure, np.zeros(len(self.episodes)))
        return not np.isnan(values[rows]).all()

    def of_phase(self, phase: str) -> tuple[str, ...]:
        """Return the conditions that have episodes of a phase."""
        return tuple(condition for own, condition in self._rows if own == phase)

    def values(
        self,
        condition: str,
        measure: str,
        phase: str = "training",
        part: slice = slice(None),
    ) -> Array:
        """Return a measure of the episodes of a condition ``(n_seeds, n_episodes)``.

        Seeds that train for a number of decisions may have different numbers of episodes. The rows
        of those with fewer end in values that are not a number.

        Parameters
        ----------
        condition
            Label of the condition.
        measure
            Name of a measure, ``steps`` or ``return``.
        phase
            Phase of the episodes.
        part
            Episodes of each seed, such as its last five.

        Raises
        ------
        KeyError
            If there are no such episodes.
        """
        rows = self._rows[phase, condition]
        values = self._measured[measure][rows]
        seeds = self._seeds[rows]
        starts = 1 + np.flatnonzero(seeds[1:] != seeds[:-1])
        series = [own[part] for own in np.split(values, starts)]
        values = pad_rows(series)
        is_whole = measure in ("steps", *(m.name for m in self.measures if m.is_rate))
        return values.astype(int) if is_whole and not np.isnan(values).any() else values

    def success(self, condition: str, phase: str = "training") -> Array:
        """Return the `values` of success."""
        return self.values(condition, SUCCESS.name, phase)

    def by_seed(self, condition: str, phase: str, measure: str = SUCCESS.name) -> pd.DataFrame:
        """Return a measure's values: a row for each seed that has any, a column for each episode.

        An episode that a seed lacks is not a number.
        """
        rows = self._rows[phase, condition]
        places = self.episodes[["seed", "episode"]].iloc[rows]
        known = places.assign(value=self._measured[measure][rows]).dropna()
        wide = known.pivot(index="seed", columns="episode", values="value")
        return wide.loc[known["seed"].unique()]

    def means(self, condition: str, phase: str, measure: str = SUCCESS.name) -> pd.Series:
        """Return the means of a measure's values by seed, of the seeds that have any."""
        return row_means(self.by_seed(condition, phase, measure))

    def other_evaluations(self, condition: str) -> dict[str, str]:
        """Return the phases of a condition's further evaluations by name."""
        return {
            phase.removeprefix(EVALUATION): phase
            for phase in self.phases
            if phase.startswith(EVALUATION) and self.has(condition, phase)
        }

    @cached_property
    def main(self) -> Measure:
        """The measure that is compared by default: the first, or the return if that never varies.

        Where returns are left out, it is the first measure that can vary.
        """
        main = main_measure(self.measures)
        if main != RETURN or self.episodes[RETURN.name].notna().any():
            return main
        return next((m for m in self.measures if not (m.is_rate and m.greatest == 0.0)), main)

    @cached_property
    def identical(self) -> tuple[tuple[str, ...], ...]:
        """Groups of conditions of equal seeds, episodes and measures, to the last digit.

        None of results without returns, unless they are published, with the groups.
        """
        if self.same_conditions is not None:
            present = [[c for c in same if self.has(c)] for same in self.same_conditions]
            return tuple(tuple(same) for same in present if len(same) > 1)
        names = ["seed", "phase", "episode", *self._measured]
        groups = dict[bytes, list[str]]()
        for condition, rows in self.episodes.groupby("condition", sort=False)[names]:
            if rows["return"].notna().all():
                key = pd.util.hash_pandas_object(rows, index=False).to_numpy().tobytes()
                groups.setdefault(key, []).append(str(condition))
        return tuple(tuple(same) for same in groups.values() if len(same) > 1)

    @cached_property
    def _rows(self) -> dict[tuple[str, str], NDArray[np.intp]]:
        """Numbers of the rows of episodes, by phase and condition."""
        return dict(self.episodes.groupby(["phase", "condition"], sort=False).indices)

    @cached_property
    def _finished(self) -> dict[str, dict[str, Array]]:
        """Columns of finished trials by condition, but for those that lack a value."""
        done = self.trials[self.trials["state"] == DONE]
        columns = {name: (own.to_numpy(), own.notna().to_numpy()) for name, own in done.items()}
        return {
            condition: {n: own[rows] for n, (own, known) in columns.items() if known[rows].all()}
            for condition, rows in done.groupby("condition", sort=False).indices.items()
        }

    @cached_property
    def _seeds(self) -> Array:
        """Seed of each row of episodes."""
        return self.episodes["seed"].to_numpy()

    @cached_property
    def _measured(self) -> dict[str, Array]:
        names = {"steps", "return", *(measure.name for measure in self.measures)}
        columns = self.episodes[[name for name in self.episodes if name in names]]
        return {n: own.to_numpy(dtype=float, na_value=np.nan) for n, own in columns.items()}


def pad_rows(rows: Sequence[Array]) -> Array:
    """Return rows as one array, in which those that are shorter end in NaN.

    Examples
    --------
    >>> pad_rows([np.array([1, 2]), np.array([3])]).tolist()
    [[1.0, 2.0], [3.0, nan]]
    """
    longest = max(map(len, rows))
    if all(len(row) == longest for row in rows):
        return np.concatenate(rows).reshape(len(rows), longest)  # faster than `np.stack`
    padded = np.full((len(rows), longest), np.nan)
    for own, row in zip(padded, rows, strict=True):
        own[: len(row)] = row
    return padded


def row_means(values: pd.DataFrame) -> pd.Series:
    """Return the mean of each row without its missing values.

    Sums are rounded once, so that rows of the same values in another order have equal means.
    """
    known = (row[~np.isnan(row)] for row in values.to_numpy(dtype=float))
    means = [math.fsum(row) / len(row) if len(row) else math.nan for row in known]
    return pd.Series(means, values.index, dtype=float)


def read(store: Store) -> Results:
    """Read all that has been run; what has failed is in the frame of trials alone."""
    episodes, trials = (
        pd.DataFrame(list(rows), columns=names)
        for names, rows in (store.episodes(), store.trials())
    )
    seconds = [name for name in trials.columns if name.startswith(SECONDS)]
    usage = [row[2] for row in store.numbers() if not row[4]]
    results = assemble(
        [episodes], [trials], store.phases(), store.columns(), store.measures(), seconds + usage
    )
    return replace(results, step_limits=step_limits(store.spec()))


def assemble(
    episodes: Sequence[pd.DataFrame],
    trials: Sequence[pd.DataFrame],
    phases: Iterable[str],
    columns: Mapping[str, SpecTable],
    measures: tuple[Measure, ...],
    usage: Iterable[str],
) -> Results:
    """Return results with the rows of all given frames, and descriptions of the columns.

    Rates are truth values. The other arguments are attributes of `Results`.
    """
    swept = {key: ("", "a swept key") for row in columns.values() for key in row}
    names = [measure.name for measure in measures]
    all_episodes = _concatenate(
        episodes, ["condition", *swept, "seed", "phase", "episode", "steps", *names, "return"]
    )
    all_trials = _concatenate(trials, ["condition", *swept, "seed", "state"])
    measured = {}
    for measure in measures:
        measured[measure.name] = measure.unit, f"{measure.title}, {measure.gathering} of its steps"
        if measure.is_rate:
            is_whole = all_episodes[measure.name].notna().all()
            kind = bool if is_whole else "boolean"
            all_episodes[measure.name] = all_episodes[measure.name].astype(kind)
    seconds = {name: ("s", "time spent") for name in all_trials if name.startswith(SECONDS)}
    _describe(all_episodes, swept | measured | EPISODE_COLUMNS)
    _describe(all_trials, swept | seconds | NUMBERS | TRIAL_COLUMNS)
    return Results(
        all_episodes, all_trials, tuple(phases), columns, measures, tuple(dict.fromkeys(usage))
    )


def _concatenate(frames: Sequence[pd.DataFrame], names: Sequence[str]) -> pd.DataFrame:
    """Return frames below each other, with columns of these names first."""
    whole = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=[*names])
    return whole.reindex(columns=[*names, *(n for n in whole.columns if n not in names)])


def _describe(frame: pd.DataFrame, known: Mapping[str, tuple[str, str]]) -> None:
    of_studies = "1", "a number of the study's own"
    frame.attrs["columns"] = {
        name: dict(zip(("unit", "meaning"), known.get(name, of_studies), strict=True))
        for name in frame.columns
    }


def from_arrays(
    phases: Mapping[str, Mapping[str, Mapping[str, ArrayLike]]],
    seeds: Mapping[str, Sequence[int]],
    numbers: Mapping[str, Mapping[str, ArrayLike]],
    usage: Mapping[str, Mapping[str, ArrayLike]],
    columns: Mapping[str, SpecTable],
    measures: tuple[Measure, ...],
) -> Results:
    """Return results as frames, given as arrays.

    Parameters
    ----------
    phases
        By phase, condition and name of a measure, ``steps`` or ``return``, the values
        ``(n_seeds, n_episodes)``. Episodes that a seed does not have are not a number.
    seeds
        By condition, in the order of the arrays' rows.
    numbers, usage
        By condition and name, numbers of whole trials ``(n_seeds,)``; usage differs from run to
        run.
    columns, measures
        See `Results`.
    """
    episodes = []
    trials = []
    for condition, own in seeds.items():
        label = {"condition": condition, **columns.get(condition, {})}
        for phase, by_condition in phases.items():
            arrays = {name: np.asarray(a) for name, a in by_condition.get(condition, {}).items()}
            if arrays:
                count = next(iter(arrays.values())).shape[1]
                where = {"seed": np.repeat(own, count), "phase": phase}
                where["episode"] = np.tile(np.arange(count), len(own))
                values = {name: array.ravel() for name, array in arrays.items()}
                known = ~np.all([np.isnan(own) for own in values.values()], axis=0)
                episodes.append(pd.DataFrame({**label, **where, **values})[known])
        kept = {**numbers.get(condition, {}), **usage.get(condition, {})}
        trials.append(pd.DataFrame({**label, "seed": own, "state": DONE, **kept}))
    names = [name for own in usage.values() for name in own]
    return assemble(episodes, trials, phases, columns, measures, names)


NOTHING = partial(from_arrays, {}, {}, {}, {}, {}, (SUCCESS,))
"""Returns results of no trials."""


EPISODE_COLUMNS, TRIAL_COLUMNS, NUMBERS = tomllib.loads(
    Path(__file__).with_name("columns.toml").read_text(encoding="utf-8")
).values()
"""Unit and meaning by name: of the columns of episodes that every scenario has, of those of trials,
and of numbers of whole trials."""

SHARES = ("least_touching", "all_touching")
"""Numbers of whole trials that are shares."""
_IN_MS = {
    "decision_median": ("decision_ms", "decision time"),
    "decision_99": ("decision_99_ms", "99th percentile of decision time"),
}
"""Name and title of numbers that are shown in milliseconds."""


def describe_number(name: str) -> tuple[Measure, float]:
    """Return how a number is shown, and by what it is multiplied for that.

    Examples
    --------
    >>> measure, factor = describe_number("decision_median")
    >>> measure.name, measure.heading, factor
    ('decision_ms', 'decision time [ms]', 1000.0)
    >>> describe_number("messages")[0].unit
    '1'
    """
    if name in _IN_MS:
        return Measure(*_IN_MS[name], "ms", better="lower", least=0.0), 1e3
    is_time = name.startswith((SECONDS, CPU))
    unit, *_ = NUMBERS.get(name, ("s" if is_time else "1",))
    least = 0.0 if is_time or name in NUMBERS else None  # numbers of other studies may be negative
    return Measure(name, name, unit, least=least, greatest=1.0 if name in SHARES else None), 1.0
