"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Rates are kept as one character an episode, steps and other measures in three decimals; returns are
left out. Claims are always decided by results in this form, so the committed files give the table
that the run gave.

The other form is the JSON of marl-eval (Gorsane et al. 2022), which BenchMARL and Mava write, too:
``environment -> task -> algorithm -> run``; a run has ``step_0``, ``step_1``, ..., each with its
``step_count`` and lists of what was measured there, and ``absolute_metrics``, lists of what the
trained were measured by. Here a condition is an algorithm, an episode of training a step, and the
evaluation the absolute metrics. Of a step that lists several values their mean is read.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import RESULTS_VERSION, measures_from, tables
from ..store.database import SECONDS as PARTS
from .results import SECONDS, Array, Results, from_arrays

DECIMALS = 3
FEW = 100
"""Fewer rows, or values, are always written one by one."""


def dumps(outline: StudyOutline, results: Results) -> str:
    """Return results of this version, and their spec, as JSON text."""
    measures = [m for m in results.measures if m.name in results.episodes]
    rates = {"steps": False} | {measure.name: measure.is_rate for measure in measures}
    content = {
        "results_version": RESULTS_VERSION,
        "spec": outline.table,
        "columns": results.columns,
        "measures": tables(measures),
        "seeds": {c: _counted(results.seeds(c)) for c in results.conditions},
        "phases": {
            phase: {
                condition: {
                    name: _packed(results.values(condition, name, phase), is_rate=is_rate)
                    for name, is_rate in rates.items()
                    if results.has(condition, phase, name)
                }
                for condition in results.of_phase(phase)
            }
            for phase in results.phases
        },
        "numbers": _rounded(results, lambda name: name not in results.usage),
        "usage": _rounded(results, lambda name: name in results.usage),
    }
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


class Published(NamedTuple):
    """Results with their spec as a table, and the version of the code that they are of."""

    outline: StudyOutline
    results: Results
    version: int

    @property
    def note(self) -> str | None:
        """What must be noted of results of another version than this, in one line."""
        if self.version == RESULTS_VERSION:
            return None
        return f"results of version {self.version}, this is version {RESULTS_VERSION}"


def loads(text: str) -> Published:
    """Return what `dumps` has written, or results of the form of marl-eval."""
    content = json.loads(text)
    if "results_version" not in content:
        results = _from_marl_eval(content)
        outline = StudyOutline.noted(_spec_of_marl_eval(results), results.columns)
        return Published(outline, results, RESULTS_VERSION)
    measures = measures_from(content["measures"])
    rates = {measure.name for measure in measures if measure.is_rate}
    phases = {
        phase: {
            condition: {
                name: _unpacked(packed, is_rate=name in rates) for name, packed in arrays.items()
            }
            for condition, arrays in by_condition.items()
        }
        for phase, by_condition in content["phases"].items()
    }
    seeds = {
        condition: tuple(range(seeds) if isinstance(seeds, int) else seeds)
        for condition, seeds in content["seeds"].items()
    }
    numbers, usage = (
        {
            c: {SECONDS * (n in parts) + n: _unpacked(v, is_rate=False) for n, v in named.items()}
            for c, named in content[key].items()
        }
        for key, parts in (("numbers", ()), ("usage", PARTS))
    )
    columns = content["columns"]
    results = from_arrays(phases, seeds, numbers, usage, columns, measures)
    return Published(
        StudyOutline.noted(content["spec"], columns), results, int(content["results_version"])
    )


def read(folder: Path, studies: Iterable[str]) -> dict[str, Published]:
    """Read the files of studies; those that are missing are left out.

    Raises
    ------
    SpecError
        If a file is not what `dumps` writes.
    """
    paths = {study: folder / f"{study}.json" for study in studies}
    return {study: load(path) for study, path in paths.items() if path.exists()}


def load(path: Path) -> Published:
    """Read one file.

    Raises
    ------
    SpecError
        If it is not what `dumps` writes.
    """
    try:
        return loads(path.read_text(encoding="utf-8"))
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise SpecError(f"{path}: holds no published results: {error}") from None


def _counted(seeds: tuple[int, ...]) -> int | list[int]:
    """Return many seeds from 0 on as their number."""
    many = len(seeds) >= FEW and seeds == tuple(range(len(seeds)))
    return len(seeds) if many else list(seeds)


Packed = list[Any] | dict[str, Any]
"""An array as lists; of many rows, as flags or one value for all, with its shape."""


def _packed(values: np.ndarray, *, is_rate: bool) -> Packed:
    if not is_rate:
        rounded = np.round(values, DECIMALS)
        return _constant(rounded) or rounded.tolist()
    rows = ["".join("1" if v else "0" for v in row) for row in values]
    return rows if len(rows) < FEW else {"flags": "".join(rows), "shape": list(values.shape)}


def _unpacked(packed: Packed, *, is_rate: bool) -> np.ndarray:
    if not isinstance(packed, dict):
        return np.array([list(map(int, row)) for row in packed] if is_rate else packed)
    if is_rate:
        return np.array(list(map(int, packed["flags"]))).reshape(packed["shape"])
    return np.full(packed["shape"], packed["all"])


def _constant(values: np.ndarray) -> dict[str, Any] | None:
    """Return many equal values as one of them and their shape; None of others."""
    if values.size < FEW or not (values == values.flat[0]).all():
        return None
    return {"all": values.flat[0].item(), "shape": list(values.shape)}


def _rounded(results: Results, wanted: Callable[[str], bool]) -> dict[str, dict[str, Packed]]:
    """Return by condition the numbers of the wanted names; seconds by their part alone."""
    return {
        condition: {
            name.removeprefix(SECONDS): _constant(values) or [float(f"{v:.5g}") for v in values]
            for name, values in numbers.items()
        }
        for condition in results.conditions
        if (numbers := {n: v for n, v in results.numbers(condition).items() if wanted(n)})
    }


STEP, FINAL = "step_", "absolute_metrics"
KNOWN = ("steps", "return", SUCCESS.name)
NO_METRICS = ("step_count", "elapsed_time")


def dumps_marl_eval(results: Results, environments: Mapping[str, str], task: str) -> str:
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
        training = {name: own[i].tolist() for name, own in measured.get("training", {}).items()}
        steps = np.cumsum(training.get("steps", [])).astype(int).tolist()
        run: dict[str, Any] = {
            f"{STEP}{k}": {"step_count": n, **{name: [own[k]] for name, own in training.items()}}
            for k, n in enumerate(steps)
        }
        final = {name: own[i].tolist() for name, own in measured.get("evaluation", {}).items()}
        yield f"seed_{seed}", run | {FINAL: final}


def _from_marl_eval(table: Mapping[str, Any]) -> Results:
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
    return from_arrays(phases, seeds, {}, {}, columns, measures)


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
    return {"training": training, "evaluation": evaluation if most else {}}


def _shared(tables: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the metrics that all tables have, in the order of the first."""
    return [n for n in tables[0] if n not in NO_METRICS and all(n in own for own in tables)]


def _spec_of_marl_eval(results: Results) -> dict[str, Any]:
    """Return the table of a spec as far as results tell of it."""
    training = [results.values(c, "steps") for c in results.of_phase("training")]
    return {
        "study": "learning-curve",
        "seeds": max(len(results.seeds(c)) for c in results.conditions),
        "episodes": max((own.shape[1] for own in training), default=0),
        "steps": int(max((own.max() for own in training), default=0)),
        "evaluation": int("evaluation" in results.phases),
    }
