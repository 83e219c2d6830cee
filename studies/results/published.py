"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Rates are kept as one character an episode, steps and other measures in three decimals; returns are
left out. Claims are always decided
by results in this form, so the committed files give the table that the run gave.
"""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.schema import RESULTS_VERSION, measures_from, tables
from ..store.schema import SECONDS as PARTS
from . import marl_eval
from .results import SECONDS, Results, from_arrays

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
    """Return what `dumps` has written, or results of the form of `marl_eval`."""
    content = json.loads(text)
    if "results_version" not in content:
        results = marl_eval.read(content)
        outline = StudyOutline.noted(marl_eval.spec_of(results), results.columns)
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
            c: {prefix(n): _unpacked(v, is_rate=False) for n, v in named.items()}
            for c, named in content[key].items()
        }
        for key, prefix in (("numbers", str), ("usage", _prefixed))
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
    if is_rate and len(values) < FEW:
        return ["".join("1" if v else "0" for v in row) for row in values]
    if is_rate:
        flags = "".join("1" if v else "0" for v in values.flat)
        return {"flags": flags, "shape": list(values.shape)}
    rounded = np.round(values, DECIMALS)
    return _constant(rounded) or rounded.tolist()


def _unpacked(packed: Packed, *, is_rate: bool) -> np.ndarray:
    if isinstance(packed, dict):
        if is_rate:
            return np.array(list(map(int, packed["flags"]))).reshape(packed["shape"])
        return np.full(packed["shape"], packed["all"])
    if is_rate:
        return np.array([[int(character) for character in row] for row in packed])
    return np.array(packed)


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


def _prefixed(name: str) -> str:
    return f"{SECONDS}{name}" if name in PARTS else name
