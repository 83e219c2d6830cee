"""The JSON form of marl-eval, which Mava and BenchMARL write, too: written and read.

The form (Gorsane et al. 2022) is ``environment -> task -> algorithm -> run``. A run has steps,
``step_0``, ``step_19``, ..., each with its ``step_count`` and lists of what was measured there, and
``absolute_metrics``: lists of what the trained agents were measured by. BenchMARL writes one file a
run, and takes the best single episode of training for its absolute metrics.

Runs are paired by name, and series are aligned by ``step_count``. What is compared is the absolute
metric of a run or, where a condition has none, its value at the last common step.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError

from ...core.interface.measures import NO_SUCCESS, RETURN, SUCCESS, Measure
from ...core.numerics import pd
from ..errors import SpecError
from ..spec.tables import SpecTable
from .json_files import Finite, Json, explain
from .results import Results
from .results_file import Header
from .scores import (
    KEYS,
    LAST_STEP,
    PHASES,
    WHOLE,
    Better,
    ScoreResults,
    alike_note,
    at_last_step,
    joined_notes,
    left_out_note,
    measure_of,
    results_of,
    sort_labels,
    whole_names,
)

STEP = re.compile(r"step_0*(\d+)", re.IGNORECASE | re.ASCII)
"""Key of a step."""
ABSOLUTE = "absolute_metrics"
STEP_COUNT = "step_count"
TIME = "elapsed_time"
"""Time of a step, which is not read."""
SEED = "seed_"
"""Prefix of a run's name, before its seed."""
STEPS = "steps"
"""Metric of exported studies: the length of an episode."""
FINAL = -1
"""Step of absolute metrics, in long form."""
IGNORED = -2
"""Step of keys that are neither steps nor absolute metrics."""
NEVER = "success: never in any run; returns are compared"


def dumps(results: Results, environments: Mapping[str, str], task: str) -> str:
    """Return results as JSON text in the form of marl-eval.

    Parameters
    ----------
    results
        Results of a study.
    environments
        The environment of each condition.
    task
        Task of all conditions.

    Raises
    ------
    SpecError
        If the names of two conditions become equal, because marl-eval allows no commas in them.
    """
    table: dict[str, Any] = {}
    names: dict[str, str] = {}
    for condition in results.conditions:
        name = exported_name(condition)
        if names.setdefault(name, condition) != condition:
            raise SpecError(
                f"--format marl-eval: conditions {names[name]!r} and {condition!r} are both called "
                f"{name!r} there, where names have no commas"
            )
        runs = table.setdefault(environments[condition], {}).setdefault(task, {})
        runs[name] = dict(_exported_runs(results, condition))
    return json.dumps(table) + "\n"


def exported_name(condition: str) -> str:
    """Return the name of a condition in a file, where marl-eval allows no commas."""
    return condition.replace(",", ";")


def _exported_runs(results: Results, condition: str) -> Iterator[tuple[str, dict[str, Any]]]:
    names = ("steps", *(m.name for m in results.measures if m != NO_SUCCESS), "return")
    measured = {
        phase: {
            name: results.by_seed(condition, phase, name)
            for name in names
            if results.has(condition, phase, name)
        }
        for phase in PHASES
        if results.has(condition, phase)
    }
    for seed in results.seeds(condition):
        own = {
            phase: {name: frame.loc[seed].dropna().tolist() for name, frame in by_name.items()}
            for phase, by_name in measured.items()
        }
        training = own.get("training", {})
        steps = np.cumsum(training.get("steps", [])).astype(int).tolist()
        run: dict[str, Any] = {
            f"step_{k}": {STEP_COUNT: n, **{name: [v[k]] for name, v in training.items()}}
            for k, n in enumerate(steps)
        }
        yield f"{SEED}{seed}", run | {ABSOLUTE: own.get("evaluation", {})}


def _as_list(value: object) -> object:
    """Return what was measured once or several times, as a list."""
    return value if isinstance(value, list) else [value]


def _without_others(run: object) -> object:
    """Return a run in which keys that are no steps have no metrics."""
    if not isinstance(run, dict):
        return run
    return {key: {} if _is_ignored(key) else own for key, own in run.items()}


def _is_ignored(key: str) -> bool:
    return not STEP.fullmatch(key) and key.lower() != ABSOLUTE


Metrics = dict[str, Annotated[list[Finite], BeforeValidator(_as_list)]]
RunTable = Annotated[dict[str, Metrics], BeforeValidator(_without_others)]
Name = Annotated[str, Field(pattern=r"\S")]
Algorithms = dict[Name, Annotated[dict[Name, RunTable], Field(min_length=1)]]
FILE = TypeAdapter(dict[str, dict[str, Algorithms]])
RUN = ["task", "algorithm", "seed"]
"""Columns that name a run."""


Row = tuple[str, float, list[float]]
"""A metric of a run, its step, and the values that were measured there."""
Runs = dict[tuple[str, str, str, str], list[Row]]
"""Measurements of each run by environment, task, algorithm and name."""


def read_runs(file: Json) -> Runs:
    """Return the runs of a file.

    Raises
    ------
    ValueError
        If the file is not of this form; one line names the key and its value.
    """
    try:
        content = FILE.validate_python(file)
    except ValidationError as error:
        raise ValueError(explain(error, file)) from None
    runs = {
        (environment, task, algorithm, name): [
            *_rows(run, f"{environment}.{task}.{algorithm}.{name}")
        ]
        for environment, tasks in content.items()
        for task, algorithms in tasks.items()
        for algorithm, own in algorithms.items()
        for name, run in own.items()
    }
    if not any(values and metric != STEPS for own in runs.values() for metric, _, values in own):
        raise ValueError("no run has measured anything")
    return runs


def _rows(run: Mapping[str, Metrics], path: str) -> Iterator[Row]:
    """Yield metric, step and values of the steps and the absolute metrics of a run."""
    keys: dict[str, str] = {}
    known = set[tuple[str, float]]()
    for key, metrics in run.items():
        if _is_ignored(key):
            yield key, IGNORED, []
            continue
        match = STEP.fullmatch(key)
        if (first := keys.setdefault(match[1] if match else ABSOLUTE, key)) != key:
            raise ValueError(f"{path}.{key}: is {first}, too")
        step = _step_count(metrics, f"{path}.{key}") if match else FINAL
        for name, values in metrics.items():
            if name in (STEP_COUNT, TIME) or not values:
                continue
            metric = f"{name} (own)" if name in KEYS else name
            if (metric, step) in known:
                raise ValueError(
                    f"{path}.{key}.{STEP_COUNT} = {step}: another step of the run has it"
                )
            known.add((metric, step))
            yield metric, step, values


def _step_count(metrics: Metrics, path: str) -> float:
    if STEP_COUNT not in metrics:
        raise ValueError(f"{path}.{STEP_COUNT}: is missing")
    count, *others = metrics[STEP_COUNT] or [-1]
    if others or count < 0 or count % 1:
        raise ValueError(f"{path}.{STEP_COUNT} = {count}: must be a whole number from 0 on")
    return count


def is_exported_by(runs: Runs, header: Header) -> bool:
    """Return whether all runs are of conditions of a study."""
    known = {exported_name(condition) for condition in header.columns}
    return {algorithm for _, _, algorithm, _ in runs} <= known


def results_of_runs(runs: Runs, better: Better, header: Header | None) -> ScoreResults:
    """Return the results of runs; the keys of their conditions are ``algorithm`` and ``task``.

    Parameters
    ----------
    runs
        Runs of any algorithms and tasks.
    better
        Which values are better.
    header
        Description of the study that exported the runs, if one did.
    """
    labels = _labels(runs, header)
    columns = header.columns if header else _columns(labels)
    every = pd.DataFrame(
        [(f"{e}/{t}", *names, *row) for (e, t, *names), own in runs.items() for row in own],
        columns=[*RUN, "measure", "step", "values"],
    )
    ignored = every.loc[every["step"] == IGNORED, "measure"].unique()
    frame = _labeled(every[every["step"] != IGNORED], labels)
    n_empty = len(runs) - len(frame[RUN].drop_duplicates())
    notes = []
    if len(ignored):
        notes.append(f"keys that are no steps are ignored: {', '.join(sorted(ignored))}")
    notes += alike_note("algorithm", frame["algorithm"])
    notes += alike_note("seed", frame["seed"].str.removeprefix(SEED), are_runs=True)
    if n_empty:
        notes.append(f"{n_empty} of {len(runs)} runs have measured nothing: left out")
    phases, chosen = _phases(frame, is_exported=header is not None)
    wide = pd.concat(phases).pivot(index=KEYS, columns="measure", values="value").reset_index()
    if wide["seed"].str.fullmatch(f"{SEED}({WHOLE.pattern})").all():
        wide["seed"] = wide["seed"].str.removeprefix(SEED)
    wide["seed"] = whole_names(wide["seed"])
    metrics = sorted(frame["measure"].unique())
    measures = header.measures if header else _measures(wide, metrics, better)
    if not header and measures[0] == NO_SUCCESS and SUCCESS.name in metrics:
        notes.append(NEVER)
    several_tasks = len({task for task, _ in labels}) > 1
    is_crossed = several_tasks and len(columns) > len({algorithm for _, algorithm in labels})
    results = results_of(wide, columns, measures)
    return ScoreResults(results, (*notes, *chosen), "algorithm" if is_crossed else None)


def _labels(runs: Runs, header: Header | None) -> dict[tuple[str, str], str]:
    """Return the label of each algorithm on each task; the task is named if that is necessary."""
    pairs = dict.fromkeys((f"{e}/{t}", algorithm) for e, t, algorithm, _ in runs)
    times = Counter(algorithm for _, algorithm in pairs)
    labels = {
        (task, algorithm): algorithm if times[algorithm] == 1 else f"{algorithm}, {task}"
        for task, algorithm in pairs
    }
    if len({*labels.values()}) < len(labels):
        raise ValueError("two algorithms have the same name, if their task is named")
    exported = {exported_name(c): c for c in header.columns} if header else {}
    return {pair: exported.get(label, label) for pair, label in labels.items()}


def _columns(labels: Mapping[tuple[str, str], str]) -> dict[str, SpecTable]:
    several = len({task for task, _ in labels}) > 1
    columns = {
        label: {"algorithm": algorithm} | ({"task": task} if several else {})
        for (task, algorithm), label in labels.items()
    }
    return {label: columns[label] for label in sort_labels(columns)}


def _labeled(frame: pd.DataFrame, labels: Mapping[tuple[str, str], str]) -> pd.DataFrame:
    """Return measurements with their condition, mean value and number of the step in the run."""
    pairs = zip(frame["task"], frame["algorithm"], strict=True)
    steps = frame["step"].where(frame["step"] != FINAL)
    return frame.assign(
        condition=[labels[pair] for pair in pairs],
        value=frame["values"].map(np.mean).astype(float),
        episode=steps.groupby([frame[name] for name in RUN]).rank("dense").fillna(1).astype(int)
        - 1,
    )


def _phases(frame: pd.DataFrame, *, is_exported: bool) -> tuple[list[pd.DataFrame], list[str]]:
    """Return the scores of each phase, and notes on what is compared.

    An export of this toolkit has an episode at each step. Of other files the absolute metrics are
    evaluations, and series are compared at their last common step.
    """
    is_final = frame["step"] == FINAL
    series = frame[~is_final].assign(phase="training")
    final = frame[is_final].assign(phase="evaluation")
    if is_exported:
        return [series, _final(final)], []
    notes = []
    phases = []
    for (metric, _), every in frame.groupby(["measure", "task"]):
        own = series.loc[every.index.intersection(series.index)]
        absolute = final.loc[every.index.intersection(final.index)]
        rows, note = at_last_step(own, STEP_COUNT)
        if {*absolute["condition"]} == {*every["condition"]}:
            phases.append(_final(absolute))
            note = f"{ABSOLUTE} are compared by default{left_out_note(every, absolute)}"
            if len(rows):
                note += f"; --phase '{LAST_STEP}' compares {STEP_COUNT} {rows['step'].iloc[0]:.0f}"
        if len(rows):
            phases.append(rows.assign(phase=LAST_STEP, episode=0))
            phases.append(_curves(own[own["step"] <= rows["step"].iloc[0]], rows))
        notes.append((str(metric), note))
    if not phases:
        raise ValueError("; ".join(joined_notes(notes)))
    return phases, joined_notes(notes)


def _final(absolute: pd.DataFrame) -> pd.DataFrame:
    """Return absolute metrics with an episode for each value, or their means.

    Means are taken where the runs of a condition have different numbers of values.
    """
    counts = absolute["values"].map(len).groupby(absolute["condition"]).transform("nunique")
    lists = absolute["values"].where(counts == 1, absolute["value"].map(lambda mean: [mean]))
    episodes = lists.map(lambda values: [*range(len(values))])
    rows = absolute.assign(value=lists, episode=episodes).explode(["episode", "value"])
    return rows.astype({"episode": int, "value": float})


def _curves(series: pd.DataFrame, kept: pd.DataFrame) -> pd.DataFrame:
    """Return the curves of the runs that are kept, at the steps that all of a condition have."""
    own = series.merge(kept[["condition", "seed"]])
    of_condition = own.groupby("condition")["seed"].transform("nunique")
    own = own[own.groupby(["condition", "step"])["seed"].transform("nunique") == of_condition]
    return own.assign(episode=own.groupby(["condition", "seed"])["step"].rank().astype(int) - 1)


def _measures(wide: pd.DataFrame, metrics: Sequence[str], better: Better) -> Sequence[Measure]:
    """Return the measures of metrics; returns are compared unless success is measured."""
    if RETURN.name in metrics and better == "lower":
        raise ValueError(
            "better = 'lower': the metric return is better if it is higher, allowed: higher, or "
            "another name of the metric"
        )
    names = [name for name in metrics if name not in (STEPS, RETURN.name)]
    measures = [measure_of(wide, name, name, better) for name in names]
    measures.sort(key=lambda measure: measure != SUCCESS)
    if RETURN.name in metrics and (SUCCESS not in measures or not wide[SUCCESS.name].any()):
        measures = [NO_SUCCESS, *(measure for measure in measures if measure != SUCCESS)]
    return measures
