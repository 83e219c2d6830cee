"""Results in the form of marl-eval, which other libraries write.

The JSON of marl-eval (Gorsane et al. 2022), which BenchMARL and Mava write, too:
``environment -> task -> algorithm -> run``; a run has ``step_0``, ``step_1``, ..., each with its
``step_count`` and lists of what was measured there, and ``absolute_metrics``, lists of what the
trained were measured by. Here a condition is an algorithm, an episode of training a step, and the
evaluation the absolute metrics. Of a step that lists several values their mean is read.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from .json_values import JsonValue
from .results import Array, Results, from_arrays

STEP = "step_"
FINAL = "absolute_metrics"
KNOWN = ("steps", "return", SUCCESS.name)
NO_METRICS = ("step_count", "elapsed_time")


def dumps(results: Results, environments: Mapping[str, str], task: str) -> str:
    """Return results as JSON text in the form of marl-eval.

    Parameters
    ----------
    results
        Of a study.
    environments
        The environment of each condition.
    task
        What all of them do.
    """
    table: dict[str, Any] = {}
    for condition in results.conditions:
        runs = table.setdefault(environments[condition], {}).setdefault(task, {})
        name = condition.replace(",", ";")  # marl-eval refuses commas in names of algorithms
        runs[name] = dict(_runs(results, condition))
    return json.dumps(table) + "\n"


def _runs(results: Results, condition: str) -> Iterator[tuple[str, dict[str, Any]]]:
    measured = {
        phase: {
            name: results.values(condition, name, phase).astype(float)
            for name in ("steps", *(measure.name for measure in results.measures), "return")
            if results.has(condition, phase, name)
        }
        for phase in ("training", "evaluation")
        if results.has(condition, phase)
    }
    for i, seed in enumerate(results.seeds(condition)):
        known = {name: own[i] for name, own in measured.get("training", {}).items()}
        training = {name: own[~np.isnan(own)].tolist() for name, own in known.items()}
        steps = np.cumsum(training.get("steps", [])).astype(int).tolist()
        run: dict[str, Any] = {
            f"{STEP}{k}": {"step_count": n, **{name: [own[k]] for name, own in training.items()}}
            for k, n in enumerate(steps)
        }
        final = {name: own[i].tolist() for name, own in measured.get("evaluation", {}).items()}
        yield f"seed_{seed}", run | {FINAL: final}


def results_of(file: JsonValue) -> Results:
    """Return the results that a file of this form holds; columns are ``algorithm`` and ``task``.

    Raises
    ------
    ValueError
        If it is not of this form.
    """
    phases: dict[str, dict[str, dict[str, Array]]] = {"training": {}, "evaluation": {}}
    seeds: dict[str, tuple[int, ...]] = {}
    columns: dict[str, dict[str, str]] = {}
    tasks = [
        (f"{environment}/{task}", algorithm, runs)
        for environment, by_task in file.table().items()
        for task, by_algorithm in by_task.table().items()
        for algorithm, runs in by_algorithm.table().items()
    ]
    several = len({task for task, *_ in tasks}) > 1
    for task, algorithm, runs in tasks:
        label = f"{algorithm}, {task}" if several else algorithm
        columns[label] = {"algorithm": algorithm, **({"task": task} if several else {})}
        seeds[label] = tuple(range(len(runs.table())))
        for phase, arrays in _arrays(runs).items():
            phases[phase][label] = arrays
    names = dict.fromkeys(n for by in phases.values() for own in by.values() for n in own)
    if not names.keys() - {"steps"}:
        raise ValueError("no run has measured anything")
    others = (Measure(n, n, better="higher") for n in names if n not in KNOWN)
    measures = (*([SUCCESS] if SUCCESS.name in names else []), *others)
    return from_arrays(phases, seeds, {}, {}, columns, measures)


def _arrays(runs: JsonValue) -> dict[str, dict[str, Array]]:
    """Return what runs measured by phase and name, ``(n_runs, n_episodes)``, steps as differences.

    Of runs that were cut short, what all have; of what one has not measured, nothing.
    """
    own = [*runs.table().values()]
    if not own:
        raise runs.refusal("a table of one run or more")
    trained = [_steps(run) for run in own]
    length = min(map(len, trained))
    training: dict[str, Array] = {}
    if length:
        for name in _shared([step for steps in trained for step in steps[:length]]):
            means = [
                [np.mean(_values(step.child(name))) for step in steps[:length]] for steps in trained
            ]
            training[name] = np.array(means, dtype=float)
        counts = [[step.child("step_count").whole() for step in s[:length]] for s in trained]
        training["steps"] = np.diff(np.array(counts, dtype=float), axis=1, prepend=0.0)
    finals = [run.child(FINAL) for run in own if FINAL in run.table()]
    if len(finals) < len(own):
        return {"training": training, "evaluation": {}}
    final = {name: [_values(table.child(name)) for table in finals] for name in _shared(finals)}
    most = min((len(values) for each in final.values() for values in each), default=0)
    evaluation = {n: np.array([values[:most] for values in each]) for n, each in final.items()}
    return {"training": training, "evaluation": evaluation if most else {}}


def _steps(run: JsonValue) -> list[JsonValue]:
    """Return the steps of a run in order, none left out."""
    count = sum(key.startswith(STEP) for key in run.table())
    return [run.child(f"{STEP}{k}") for k in range(count)]


def _values(metric: JsonValue) -> Array:
    """Return what was measured once or several times."""
    if isinstance(metric.content, list):
        return metric.array(1).astype(float)
    return np.array([metric.number()], dtype=float)


def _shared(tables: Sequence[JsonValue]) -> list[str]:
    """Return the metrics that all tables have, in the order of the first."""
    names = [table.table().keys() for table in tables]
    return [n for n in names[0] if n not in NO_METRICS and all(n in own for own in names)]


def spec_of(results: Results) -> dict[str, Any]:
    """Return the table of a spec as far as results tell of it."""
    training = [results.values(c, "steps") for c in results.of_phase("training")]
    return {
        "study": "learning-curve",
        "seeds": max(len(results.seeds(c)) for c in results.conditions),
        "episodes": max((own.shape[1] for own in training), default=0),
        "steps": int(max((own.max() for own in training), default=0)),
        "evaluation": int("evaluation" in results.phases),
    }
