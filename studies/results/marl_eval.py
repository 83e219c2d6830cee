"""Results in the JSON of marl-eval (Gorsane et al. 2022), which BenchMARL and Mava write, too.

``environment -> task -> algorithm -> run``; a run has ``step_0``, ``step_1``, ..., each with its
``step_count`` and lists of what was measured there, and ``absolute_metrics``, lists of what the
trained were measured by. Here a condition is an algorithm, an episode of training a step, and the
evaluation the absolute metrics. Of a step that lists several values their mean is read.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.interface.scenario import SUCCESS, Measure
from .results import Array, Results, from_arrays

STEP, FINAL = "step_", "absolute_metrics"
KNOWN = ("steps", "return", SUCCESS.name)
NO_METRICS = ("step_count", "elapsed_time")


def dumps(results: Results, environments: Mapping[str, str], task: str) -> str:
    """Return results as JSON text.

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
        runs[condition] = dict(_runs(results, condition))
    return json.dumps(table) + "\n"


def _runs(results: Results, condition: str) -> Iterator[tuple[str, dict[str, Any]]]:
    names = [*(measure.name for measure in results.measures), "return"]
    measured = {
        phase: {
            name: results.values(condition, name, phase).astype(float)
            for name in ("steps", *names)
            if results.has(condition, phase, name)
        }
        for phase in ("training", "evaluation")
        if results.has(condition, phase)
    }
    for i, seed in enumerate(results.seeds(condition)):
        training = {name: own[i].tolist() for name, own in measured.get("training", {}).items()}
        steps = np.cumsum(training.get("steps", [])).astype(int).tolist()
        run: dict[str, Any] = {
            f"{STEP}{k}": {"step_count": n, **{name: [own[k]] for name, own in training.items()}}
            for k, n in enumerate(steps)
        }
        final = {name: own[i].tolist() for name, own in measured.get("evaluation", {}).items()}
        yield f"seed_{seed}", run | {FINAL: final}


def read(table: Mapping[str, Any]) -> Results:
    """Return the results that a table of JSON holds; columns are ``algorithm`` and ``task``.

    Raises
    ------
    ValueError, KeyError, TypeError, AttributeError
        If it is not of this form.
    """
    phases: dict[str, dict[str, dict[str, Array]]] = {"training": {}, "evaluation": {}}
    seeds, columns = dict[str, tuple[int, ...]](), dict[str, dict[str, str]]()
    tasks = [
        (f"{environment}/{task}", algorithm, runs)
        for environment, by_task in table.items()
        for task, by_algorithm in by_task.items()
        for algorithm, runs in by_algorithm.items()
    ]
    several = len({task for task, *_ in tasks}) > 1
    for task, algorithm, runs in tasks:
        label = f"{algorithm}, {task}" if several else algorithm
        columns[label] = {"algorithm": algorithm, **({"task": task} if several else {})}
        seeds[label] = tuple(range(len(runs)))
        for phase, arrays in _arrays(list(runs.values())).items():
            phases[phase][label] = arrays
    names = dict.fromkeys(n for by in phases.values() for own in by.values() for n in own)
    if not names.keys() - {"steps"}:
        raise ValueError("no run has measured anything")
    others = (Measure(n, n, better="higher") for n in names if n not in KNOWN)
    measures = (*([SUCCESS] if SUCCESS.name in names else []), *others)
    nothing: dict[str, dict[str, Array]] = {label: {} for label in columns}
    return from_arrays(phases, seeds, nothing, nothing, columns, measures)


def _arrays(runs: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Array]]:
    """Return what runs measured by phase and name, ``(n_runs, n_episodes)``, steps as differences.

    Of runs that were cut short, what all have; of what one has not measured, nothing.
    """
    trained = [
        [run[f"{STEP}{k}"] for k in range(sum(key.startswith(STEP) for key in run))] for run in runs
    ]
    length = min(map(len, trained))
    training: dict[str, Array] = {}
    if length:
        for name in _shared([step for steps in trained for step in steps[:length]]):
            means = [[np.mean(step[name]) for step in steps[:length]] for steps in trained]
            training[name] = np.array(means, dtype=float)
        counts = [[step["step_count"] for step in steps[:length]] for steps in trained]
        training["steps"] = np.diff(np.array(counts, dtype=float), axis=1, prepend=0.0)
    finals = [run.get(FINAL, {}) for run in runs]
    final = {n: [np.ravel(own[n]).astype(float) for own in finals] for n in _shared(finals)}
    most = min((len(values) for own in final.values() for values in own), default=0)
    evaluation = {n: np.array([values[:most] for values in own]) for n, own in final.items()}
    phases = {"training": training, "evaluation": evaluation if most else {}}
    return {phase: arrays for phase, arrays in phases.items() if arrays}


def _shared(tables: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the metrics that all tables have, in the order of the first."""
    return [n for n in tables[0] if n not in NO_METRICS and all(n in own for own in tables)]


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
