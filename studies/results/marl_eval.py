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
from typing import Any, NamedTuple

import numpy as np

from ...core.interface.measures import NO_SUCCESS, RETURN, SUCCESS, Measure
from ...core.numerics import pd
from ..errors import SpecError
from ..spec.tables import SpecTable
from .foreign import Better, score_kind
from .json_values import JsonValue
from .long_form import KEYS, WHOLE, pack, sort_labels, whole_names
from .results import Results
from .series import LAST_STEP, last_common_step, left_out_note, step_note

STEP = re.compile(r"step_(\d+)", re.IGNORECASE | re.ASCII)
"""Key of a step."""
ABSOLUTE = "absolute_metrics"
NO_METRICS = ("step_count", "elapsed_time")
SEED = "seed_"
"""Prefix of a run's name, before its seed."""
STEPS = "steps"
"""Metric of exported studies: the length of an episode."""
FINAL = -1
"""Step of absolute metrics, in long form."""
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
        for phase in ("training", "evaluation")
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
            f"step_{k}": {"step_count": n, **{name: [v[k]] for name, v in training.items()}}
            for k, n in enumerate(steps)
        }
        yield f"{SEED}{seed}", run | {ABSOLUTE: own.get("evaluation", {})}


class AlgorithmRun(NamedTuple):
    """Measurements of one run of an algorithm on a task."""

    task: str
    """Environment and task."""
    algorithm: str
    name: str
    series: dict[str, dict[int, list[float]]]
    """Measured values by metric and step count."""
    absolute: dict[str, list[float]]
    """Absolute metrics by name."""
    ignored: tuple[str, ...]
    """Keys that are neither steps nor absolute metrics."""

    @property
    def key(self) -> tuple[str, str, str]:
        """Task, algorithm and name of the run."""
        return self.task, self.algorithm, self.name


def runs_of(file: JsonValue) -> list[AlgorithmRun]:
    """Return the runs of a file.

    Raises
    ------
    ValueError
        If the file is not of this form; one line names the key and its value.
    """
    runs = [
        _run((f"{environment}/{task}", algorithm, name), run)
        for environment, by_task in file.table().items()
        for task, by_algorithm in by_task.table().items()
        for algorithm, runs in by_algorithm.table().items()
        for name, run in _some(runs).items()
    ]
    if not any({*run.series, *run.absolute} - {STEPS} for run in runs):
        raise ValueError("no run has measured anything")
    return runs


def _some(runs: JsonValue) -> dict[str, JsonValue]:
    if not runs.table():
        raise runs.refusal("a table of one run or more")
    return runs.table()


def _run(key: tuple[str, str, str], run: JsonValue) -> AlgorithmRun:
    series: dict[str, dict[int, list[float]]] = {}
    absolute: dict[str, list[float]] = {}
    known: dict[object, str] = {}
    ignored = []
    for name, own in run.table().items():
        step = STEP.fullmatch(name)
        place = int(step[1]) if step else name.lower()
        if not step and place != ABSOLUTE:
            ignored.append(name)
            continue
        if place in known:
            raise ValueError(f"{own.key}: is {known[place]}, too")
        known[place] = name
        metrics = {n: v for n, v in own.table().items() if n not in NO_METRICS}
        values = {n: listed for n, v in metrics.items() if (listed := _values(v))}
        if not step:
            absolute = values
            continue
        count = own.child("step_count")
        for metric, listed in values.items():
            at = series.setdefault(metric, {})
            if count.whole() in at:
                raise count.refusal("a step count that no other step of the run has")
            at[count.whole()] = listed
    return AlgorithmRun(*key, series, absolute, tuple(ignored))


def _values(metric: JsonValue) -> list[float]:
    """Return what was measured once or several times, as a list."""
    if isinstance(metric.content, list):
        return metric.array(1).astype(float).tolist()
    return [float(metric.number())]


class Evaluations(NamedTuple):
    """Results of a file, and what was left out or chosen when it was read."""

    results: Results
    notes: tuple[str, ...]
    by: str | None
    """Key by which conditions are compared: the algorithm, if there are several tasks."""


def results_of(
    runs: Sequence[AlgorithmRun],
    better: Better = "higher",
    conditions: Mapping[str, SpecTable] | None = None,
    measures: Sequence[Measure] = (),
) -> Evaluations:
    """Return the results of runs; the keys of their conditions are ``algorithm`` and ``task``.

    Parameters
    ----------
    runs
        Runs of any algorithms and tasks.
    better
        Which values are better.
    conditions, measures
        What is known of an exported study: its conditions with their swept keys, and its measures.
    """
    labels = _labels(runs, conditions)
    columns = conditions or _columns(runs, labels)
    frame = _long(runs, labels)
    metrics = sorted(frame["measure"].unique())
    ignored = sorted({key for run in runs for key in run.ignored})
    notes = [f"keys that are no steps are ignored: {', '.join(ignored)}"] if ignored else []
    empty = sum(not (run.series or run.absolute) for run in runs)
    notes += [f"{empty} of {len(runs)} runs have measured nothing: left out"] if empty else []
    is_exported = bool(conditions) and _counts_episodes(runs)
    phases, chosen = _phases(frame, is_exported)
    wide = pd.concat(phases).pivot(index=KEYS, columns="measure", values="value").reset_index()
    wide["seed"] = whole_names(_without_prefix(wide["seed"]))
    known = measures or _measures(wide, metrics, better)
    if not measures and known[0] == NO_SUCCESS and SUCCESS.name in metrics:
        notes.append(NEVER)
    tasks = {run.task for run in runs}
    is_crossed = len(tasks) > 1 and len(columns) > len({run.algorithm for run in runs})
    results = pack(wide, columns, known)
    return Evaluations(results, (*notes, *chosen), "algorithm" if is_crossed else None)


def _labels(
    runs: Sequence[AlgorithmRun], conditions: Mapping[str, SpecTable] | None
) -> dict[tuple[str, str], str]:
    """Return the label of each algorithm on each task; the task is named if that is necessary."""
    pairs = dict.fromkeys((run.task, run.algorithm) for run in runs)
    exported = {exported_name(condition): condition for condition in conditions or ()}
    times = Counter(algorithm for _, algorithm in pairs)
    labels = {
        (task, algorithm): algorithm if times[algorithm] == 1 else f"{algorithm}, {task}"
        for task, algorithm in pairs
    }
    if len({*labels.values()}) < len(labels):
        raise ValueError("two algorithms have the same name, if their task is named")
    return {pair: exported.get(label, label) for pair, label in labels.items()}


def _columns(
    runs: Sequence[AlgorithmRun], labels: Mapping[tuple[str, str], str]
) -> dict[str, dict[str, object]]:
    several = len({run.task for run in runs}) > 1
    columns: dict[str, dict[str, object]] = {
        label: {"algorithm": algorithm, **({"task": task} if several else {})}
        for (task, algorithm), label in labels.items()
    }
    return {label: columns[label] for label in sort_labels(columns)}


def _long(runs: Sequence[AlgorithmRun], labels: Mapping[tuple[str, str], str]) -> pd.DataFrame:
    """Return a row for each metric of each step of each run; the step of absolute metrics is -1.

    Values are lists. `episode` is the number of the step in its run.
    """
    rows = []
    for run in runs:
        key = labels[run.task, run.algorithm], run.task, run.name
        counts = sorted({count for at in run.series.values() for count in at})
        place = {count: k for k, count in enumerate(counts)}
        for metric, at in run.series.items():
            rows += [(*key, metric, count, place[count], own) for count, own in at.items()]
        rows += [(*key, metric, FINAL, 0, own) for metric, own in run.absolute.items()]
    names = ["condition", "task", "seed", "measure", "step", "episode", "values"]
    frame = pd.DataFrame(rows, columns=names)
    return frame.assign(value=[float(np.mean(own)) for own in frame["values"]])


def _phases(frame: pd.DataFrame, is_exported: bool) -> tuple[list[pd.DataFrame], list[str]]:
    """Return the scores of each phase in long form, and notes on what is compared."""
    is_final = frame["step"] == FINAL
    series = frame[~is_final].assign(phase="training")
    final = frame[is_final].assign(phase="evaluation")
    if is_exported:  # by this toolkit: a step is an episode
        return [series, *_final(final)], []
    chosen: dict[str, list[str]] = {}
    phases = []
    for (metric, _), every in frame.groupby(["measure", "task"]):
        own = every[every["step"] != FINAL].assign(phase=LAST_STEP)
        absolute = final.loc[every.index.intersection(final.index)]
        step = last_common_step(own) if len(own) else None
        rows = own[own["step"] == step]
        if {*absolute["condition"]} == {*every["condition"]}:
            phases += _final(absolute)
            text = f"{ABSOLUTE} are compared by default{_best_note(own, absolute)}"
            text += left_out_note(every, absolute)
            text += f"; --phase '{LAST_STEP}' compares step_count {step:.0f}" if step else ""
        elif step is None:
            text = "most runs of every algorithm share no step_count: not compared"
        else:
            text = step_note(every, rows, f"step_count {step:.0f}")
        if step is not None:
            phases += [rows.assign(episode=0), _curves(own[own["step"] <= step], rows)]
        chosen.setdefault(text, []).append(str(metric))
    if not phases:
        raise ValueError("; ".join(f"{', '.join(names)}: {t}" for t, names in chosen.items()))
    chosen = {text: [*dict.fromkeys(names)] for text, names in chosen.items()}
    return phases, [f"{', '.join(names)}: {text}" for text, names in chosen.items()]


def _best_note(series: pd.DataFrame, absolute: pd.DataFrame) -> str:
    """Return that absolute metrics are the best single values of runs, if they are."""
    keys = ["condition", "seed"]
    best = series["values"].map(max).groupby([series[k] for k in keys]).max()
    many = series["values"].map(len).groupby([series[k] for k in keys]).sum()
    own = absolute.set_index(keys)["values"]
    is_best = (own.map(len) == 1).all() and own.map(max).equals(best.reindex(own.index))
    return " (the best single value of each run)" if is_best and (many > 1).all() else ""


def _final(absolute: pd.DataFrame) -> list[pd.DataFrame]:
    """Return absolute metrics with an episode for each value, or their means.

    Means are taken where the runs of a condition have different numbers of values.
    """
    phases = []
    for _, own in absolute.groupby("condition", sort=False):
        if own["values"].map(len).nunique() == 1:
            counts = range(len(own["values"].iloc[0]))
            own = own.drop(columns="value").assign(episode=[[*counts]] * len(own))
            own = own.explode(["episode", "values"]).rename(columns={"values": "value"})
            phases.append(own.astype({"episode": int, "value": float}))
        else:
            phases.append(own)
    return phases


def _curves(series: pd.DataFrame, kept: pd.DataFrame) -> pd.DataFrame:
    """Return the curves of the runs that are kept, at the steps that all of a condition have."""
    runs = pd.MultiIndex.from_frame(kept[["condition", "seed"]])
    own = series[pd.MultiIndex.from_frame(series[["condition", "seed"]]).isin(runs)]
    counts = own.groupby(["condition", "step"])["seed"].transform("nunique")
    own = own[counts == own.groupby("condition")["seed"].transform("nunique")]
    episode = own.groupby(["condition", "seed"])["step"].rank().astype(int) - 1
    return own.assign(phase="training", episode=episode)


def _counts_episodes(runs: Sequence[AlgorithmRun]) -> bool:
    """Return whether steps are episodes, so that step counts are cumulative lengths."""
    return any(run.series for run in runs) and all(_adds_up(run) for run in runs)


def _adds_up(run: AlgorithmRun) -> bool:
    lengths = {count: sum(own) for count, own in sorted(run.series.get(STEPS, {}).items())}
    counts = {count for at in run.series.values() for count in at}
    return counts == {*lengths} and [*lengths] == np.cumsum([*lengths.values()]).tolist()


def _without_prefix(names: pd.Series) -> pd.Series:
    """Return the names of runs without ``seed_``, if all have it before a whole number."""
    bare = names.str.removeprefix(SEED)
    is_seed = names.str.startswith(SEED) & bare.map(lambda name: bool(WHOLE.fullmatch(name)))
    return bare if is_seed.all() else names


def _measures(wide: pd.DataFrame, metrics: Sequence[str], better: Better) -> list[Measure]:
    """Return the measures of metrics; returns are compared unless success is measured."""
    measures: list[Measure] = []
    for name in metrics:
        if name in (STEPS, RETURN.name):
            continue
        kind = score_kind(wide, name)
        if name == SUCCESS.name and kind == "rate":
            measures.insert(0, SUCCESS)
        else:
            measures.append(Measure(name, name, better=better, is_rate=kind == "rate"))
    if RETURN.name in metrics and better == "lower":
        raise ValueError(
            "better = 'lower': the metric return is better if it is higher, allowed: higher, or "
            "another name of the metric"
        )
    if RETURN.name in metrics and (SUCCESS not in measures or not wide[SUCCESS.name].any()):
        measures = [NO_SUCCESS, *(m for m in measures if m != SUCCESS)]
    return measures
