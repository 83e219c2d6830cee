"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Rates are kept as one character an episode, other measures with every digit. Returns are left out
unless they are what is compared. Claims are always decided by results in this form, so the
committed files give the table that the run gave.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import RETURN, Measure
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import RESULTS_VERSION, tables
from ..store.database import SECONDS as PARTS
from ..store.durable import read_text
from .json_files import in_lines
from .results import SECONDS, Array, Results, from_arrays, pad_rows
from .results_file import Packed, PackedArray, ResultsFile

FEW = 100
"""Fewer rows, or values, are always written one by one."""


def dumps(outline: StudyOutline, results: Results) -> str:
    """Return results of this version, and their spec, as JSON text."""
    rates = {m.name: m.is_rate for m in results.measures if m.name in results.episodes}
    kept = {"steps": False, **rates, **({RETURN.name: False} if results.main == RETURN else {})}
    content = {
        **header(outline, results),
        "seeds": {c: _pack_seeds(results.seeds(c)) for c in results.conditions},
        "phases": {
            phase: {
                condition: {
                    name: _pack(results.values(condition, name, phase), is_rate=is_rate)
                    for name, is_rate in kept.items()
                    if results.has(condition, phase, name)
                }
                for condition in results.of_phase(phase)
            }
            for phase in results.phases
        },
        "numbers": _pack_numbers(results, lambda name: name not in results.usage),
        "usage": _pack_numbers(results, lambda name: name in results.usage),
        "identical": results.identical,
    }
    return in_lines(content)


def header(outline: StudyOutline, results: Results) -> dict[str, object]:
    """Return the description of a study: version, spec, swept keys, measures."""
    return {
        "results_version": RESULTS_VERSION,
        "spec": outline.table,
        "columns": {c: results.columns.get(c, {}) for c in results.conditions},
        "measures": tables(m for m in results.measures if m.name in results.episodes),
    }


def _pack_seeds(seeds: tuple[int, ...]) -> int | list[int]:
    """Return many seeds from 0 on as their number."""
    many = len(seeds) >= FEW and seeds == tuple(range(len(seeds)))
    return len(seeds) if many else list(seeds)


def _pack(values: Array, *, is_rate: bool) -> object:
    is_ragged = bool(np.isnan(values).any())
    rows = [row[~np.isnan(row)] for row in values]
    if not is_rate:
        return [row.tolist() for row in rows] if is_ragged else _constant(values) or values.tolist()
    flags = ["".join("1" if v else "0" for v in row) for row in rows]
    if is_ragged or len(flags) < FEW:
        return flags
    return {"flags": "".join(flags), "shape": list(values.shape)}


def _constant(values: Array) -> dict[str, object] | None:
    """Return many equal values as value and shape; None for other arrays."""
    if values.size < FEW or not (values == values.flat[0]).all():
        return None
    return {"all": values.flat[0].item(), "shape": list(values.shape)}


def _pack_numbers(results: Results, wanted: Callable[[str], bool]) -> dict[str, dict[str, object]]:
    """Return by condition the numbers of the wanted names; seconds by their part alone."""
    return {
        condition: {
            name.removeprefix(SECONDS): _constant(values) or values.tolist()
            for name, values in numbers.items()
        }
        for condition in results.conditions
        if (numbers := {n: v for n, v in results.numbers(condition).items() if wanted(n)})
    }


class Published(NamedTuple):
    """Results with their spec as a table, and notes on them."""

    outline: StudyOutline
    results: Results
    notes: tuple[str, ...]


def loads(text: str) -> Published:
    """Return what `dumps` has written.

    Raises
    ------
    ValueError, RecursionError
        If it is something else; one line names the key, its value and what is allowed.
    """
    file = ResultsFile.of(text)
    for condition in (*file.seeds, *chain(*file.identical or ())):
        if condition not in file.columns:
            raise ValueError(f"columns.{condition}: is missing")
    rates = [measure.name for measure in file.measures if measure.is_rate]
    phases = {
        phase: _arrays(by_condition, f"phases.{phase}", file.seeds, rates)
        for phase, by_condition in file.phases.items()
    }
    for phase, by_condition in phases.items():
        for condition, arrays in by_condition.items():
            _check_episodes(arrays, f"phases.{phase}.{condition}", file.measures)
    numbers = _arrays(file.numbers, "numbers", file.seeds)
    usage = {
        condition: {f"{SECONDS}{n}" if n in PARTS else n: array for n, array in named.items()}
        for condition, named in _arrays(file.usage, "usage", file.seeds).items()
    }
    results = from_arrays(phases, file.seeds, numbers, usage, file.columns, file.measures)
    results = file.limited(results)
    if file.identical is not None:
        results = replace(results, same_conditions=tuple(map(tuple, file.identical)))
    return Published(file.outline, results, file.notes)


def _arrays(
    by_condition: Mapping[str, Mapping[str, Packed]],
    key: str,
    seeds: Mapping[str, Sequence[int]],
    rates: Collection[str] | None = None,
) -> dict[str, dict[str, Array]]:
    """Return arrays by condition and name: numbers of trials, or of episodes if rates are given.

    Each must have a row for each seed.
    """
    arrays: dict[str, dict[str, Array]] = {condition: {} for condition in by_condition}
    for condition, named in by_condition.items():
        own_key = f"{key}.{condition}"
        if condition not in seeds:
            raise ValueError(f"{own_key}: is no condition that has seeds")
        for name, packed in named.items():
            is_rate = rates is not None and name in rates
            if _is_text(packed) is not is_rate:
                allowed = "text of 0 and 1, because it is a rate" if is_rate else "numbers"
                raise ValueError(f"{own_key}.{name}: must be {allowed}")
            array = _unpack(packed)
            n_seeds = len(seeds[condition])
            if array.ndim != 1 + (rates is not None) or len(array) != n_seeds or not array.size:
                raise ValueError(
                    f"{own_key}.{name}: has the shape {array.shape}, must be of {n_seeds} seeds, "
                    "a row for each"
                )
            arrays[condition][name] = array
    return arrays


def _is_text(packed: Packed) -> bool:
    if isinstance(packed, PackedArray):
        return packed.flags is not None
    return bool(packed) and isinstance(packed[0], str)


def _unpack(packed: Packed) -> Array:
    """Return the array; rows of fewer episodes end in NaN."""
    if not isinstance(packed, PackedArray):
        rows = [np.array([*map(int, row)] if isinstance(row, str) else row) for row in packed]
        return pad_rows(rows) if rows and rows[0].ndim else np.array(rows)
    if packed.flags is not None:
        return np.array([*map(int, packed.flags)]).reshape(packed.shape)
    return np.full(packed.shape, packed.all)


def _check_episodes(arrays: Mapping[str, Array], key: str, measures: Sequence[Measure]) -> None:
    """Refuse what was measured in a phase of a condition unless each measure has its episodes."""
    for name, array in arrays.items():
        if name not in {"steps", "return", *(measure.name for measure in measures)}:
            raise ValueError(f"{key}.{name}: no measure is called so")
        known = array[~np.isnan(array)]
        if name == "steps" and not ((known == np.rint(known)) & (known >= 0)).all():
            raise ValueError(f"{key}.steps: must be whole numbers, none below 0")
    if len({np.isnan(array).tobytes() for array in arrays.values()}) > 1:
        raise ValueError(f"{key}: must have as many episodes of every measure")


def load(path: Path) -> Published:
    """Read one file.

    Raises
    ------
    SpecError
        If it is not what `dumps` writes.
    """
    try:
        return loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise SpecError(f"{path}: holds no published results: {error}") from None
