"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Outcomes are kept as one character an episode, other measures in three decimals; distances and
returns are left out. Claims are always decided by results in this form, so the committed files give
the table that the run gave.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..spec.errors import SpecError
from ..spec.spec import Spec
from ..store import durable
from ..trials.trial import RESULTS_VERSION
from .results import Arrays, Results

MEASURES: dict[str, tuple[str, ...]] = {
    "learning-curve": (
        "success", "stopped_at_goal", "steps", "final_orientation_rad", "contact_fraction",
    ),
    "shapes": ("success", "stopped_at_goal", "contact_fraction"),
    "wheel-failure": ("success", "steps"),
    "scaling": ("success", "steps"),
}  # fmt: skip
"""What is kept of each study; of others it is success alone."""
OUTCOMES = ("success", "stopped_at_goal")
DECIMALS = 3


def dumps(spec: Spec, results: Results, version: int = RESULTS_VERSION) -> str:
    """Return results, their spec and the version that they are of as JSON text."""
    names = MEASURES.get(spec.study, ("success",))
    content = {
        "results_version": version,
        "spec": spec.table(),
        "seeds": results.seeds,
        "phases": {
            phase: {
                condition: {name: _packed(name, arrays[name]) for name in names}
                for condition, arrays in by_condition.items()
            }
            for phase, by_condition in results.phases.items()
        },
        "numbers": _rounded(results.numbers),
        "usage": _rounded(results.usage),
    }
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


class Published(NamedTuple):
    """Results with their spec, and the version of the code that they are of."""

    spec: Spec
    results: Results
    version: int

    @property
    def note(self) -> str | None:
        """What must be said of results of another version than this, in one line."""
        if self.version == RESULTS_VERSION:
            return None
        return f"results of version {self.version}, this is version {RESULTS_VERSION}"


def loads(text: str) -> Published:
    """Return what `dumps` has written."""
    content = json.loads(text)
    phases = {
        phase: {
            condition: {name: _unpacked(name, packed) for name, packed in arrays.items()}
            for condition, arrays in by_condition.items()
        }
        for phase, by_condition in content["phases"].items()
    }
    seeds = {condition: tuple(found) for condition, found in content["seeds"].items()}
    numbers, usage = (
        {c: {n: np.array(v) for n, v in named.items()} for c, named in content[key].items()}
        for key in ("numbers", "usage")
    )
    training, evaluation = phases.get("training", {}), phases.get("evaluation", {})
    spec = Spec.of(content["spec"])
    columns = {c.label: c.columns for c in spec.conditions()}
    results = Results(training, evaluation, phases, seeds, numbers, usage, columns)
    return Published(spec, results, int(content["results_version"]))


def write(path: Path, spec: Spec, results: Results, version: int = RESULTS_VERSION) -> None:
    """Write the same to a file, which is there whole or not at all."""
    durable.write(path, dumps(spec, results, version).encode())


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
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise SpecError(f"{path}: holds no published results: {error}") from None


def _packed(name: str, values: np.ndarray) -> list[Any]:
    if name in OUTCOMES:
        return ["".join("1" if v else "0" for v in row) for row in values]
    return np.round(values, DECIMALS).tolist()


def _unpacked(name: str, packed: list[Any]) -> np.ndarray:
    if name in OUTCOMES:
        return np.array([[int(character) for character in row] for row in packed])
    return np.array(packed)


def _rounded(named: Mapping[str, Arrays]) -> dict[str, dict[str, list[float]]]:
    return {
        condition: {name: [float(f"{v:.5g}") for v in values] for name, values in arrays.items()}
        for condition, arrays in named.items()
    }
