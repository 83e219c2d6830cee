"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Rates are kept as one character an episode, other measures with every digit. Returns are left out
unless they are what is compared. Claims are always decided by results in this form, so the
committed files give the table that the run gave.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.interface.measures import RETURN, Measure
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import SECONDS as PARTS
from ..store.durable import read_text
from .headers import MOST_EPISODES, Header, header, in_lines, seeds_of
from .json_values import JsonValue, parse
from .results import SECONDS, Array, Results, from_arrays, pad_rows

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
    }
    return in_lines(content)


class Published(NamedTuple):
    """Results with their spec as a table, and the version of the code that they are of."""

    outline: StudyOutline
    results: Results
    version: int
    notes: tuple[str, ...]


def loads(text: str) -> Published:
    """Return what `dumps` has written.

    Raises
    ------
    ValueError, RecursionError
        If it is something else; one line names the key, its value and what is allowed.
    """
    return read_file(parse(text))


def read_file(file: JsonValue) -> Published:
    """Return the results of a file as `loads` does."""
    own = Header.of(file)
    measures = own.measures
    seeds = {name: seeds_of(listed) for name, listed in file.child("seeds").table().items()}
    for condition in seeds:
        file.child("columns").child(condition)
    room = Room()
    phases = {
        phase: _arrays(by_condition, seeds, measures, room)
        for phase, by_condition in file.child("phases").table().items()
    }
    numbers = _numbers(file.child("numbers"), seeds, (), room)
    usage = _numbers(file.child("usage"), seeds, PARTS, room)
    results = own.limited(from_arrays(phases, seeds, numbers, usage, own.columns, measures))
    return Published(own.outline, results, own.version, own.notes)


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
        return loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise SpecError(f"{path}: holds no published results: {error}") from None


def _pack_seeds(seeds: tuple[int, ...]) -> int | list[int]:
    """Return many seeds from 0 on as their number."""
    many = len(seeds) >= FEW and seeds == tuple(range(len(seeds)))
    return len(seeds) if many else list(seeds)


Packed = Sequence[object] | dict[str, object]
"""An array as lists; of many rows, as flags or one value for all, with its shape."""


def _pack(values: np.ndarray, *, is_rate: bool) -> Packed:
    is_ragged = bool(np.isnan(values).any())
    rows = [row[~np.isnan(row)] for row in values]
    if not is_rate:
        return [row.tolist() for row in rows] if is_ragged else _constant(values) or values.tolist()
    flags = ["".join("1" if v else "0" for v in row) for row in rows]
    if is_ragged or len(flags) < FEW:
        return flags
    return {"flags": "".join(flags), "shape": list(values.shape)}


def _constant(values: np.ndarray) -> Packed | None:
    """Return many equal values as value and shape; None for other arrays."""
    if values.size < FEW or not (values == values.flat[0]).all():
        return None
    return {"all": values.flat[0].item(), "shape": list(values.shape)}


def _pack_numbers(results: Results, wanted: Callable[[str], bool]) -> dict[str, dict[str, Packed]]:
    """Return by condition the numbers of the wanted names; seconds by their part alone."""
    return {
        condition: {
            name.removeprefix(SECONDS): _constant(values) or values.tolist()
            for name, values in numbers.items()
        }
        for condition in results.conditions
        if (numbers := {n: v for n, v in results.numbers(condition).items() if wanted(n)})
    }


MOST_VALUES = 20_000_000
"""Values of a file that are written as one for all: some characters could fill any memory."""


class Room:
    """Number of values that compact arrays of a file may still expand to."""

    def __init__(self) -> None:
        self._left = MOST_VALUES

    def take(self, shape: JsonValue, *most: int) -> tuple[int, ...]:
        """Return the shape of an array, each side at most so long, and note what it takes."""
        sides = shape.items()
        if len(sides) != len(most):
            raise shape.refusal(f"a list of {len(most)}")
        lengths = tuple(side.whole(1, m) for side, m in zip(sides, most, strict=True))
        self._left -= math.prod(lengths)
        if self._left < 0:
            raise shape.refusal(f"small: at most {MOST_VALUES} values of a file are one for all")
        return lengths


def _arrays(
    by_condition: JsonValue,
    seeds: Mapping[str, tuple[int, ...]],
    measures: Collection[Measure],
    room: Room,
) -> dict[str, dict[str, Array]]:
    """Return what was measured in a phase, by condition and name."""
    rates = {measure.name for measure in measures if measure.is_rate}
    names = {"steps", "return", *(measure.name for measure in measures)}
    arrays: dict[str, dict[str, Array]] = {}
    for condition, value in by_condition.table().items():
        _check_condition(value, condition, seeds)
        arrays[condition] = {}
        for name, own in value.table().items():
            if name not in names:
                raise ValueError(f"{own.key}: no measure is called so")
            unpack = _unpack_rates if name in rates else _unpack
            array = unpack(own, room, len(seeds[condition]), MOST_EPISODES)
            known = array[~np.isnan(array)]
            if name == "steps" and not ((known == np.rint(known)) & (known >= 0)).all():
                raise own.refusal("whole numbers, none below 0")
            arrays[condition][name] = array
        if len({np.isnan(array).tobytes() for array in arrays[condition].values()}) > 1:
            raise ValueError(f"{value.key}: must have as many episodes of every measure")
    return arrays


def _numbers(
    value: JsonValue,
    seeds: Mapping[str, tuple[int, ...]],
    parts: Collection[str],
    room: Room,
) -> dict[str, dict[str, Array]]:
    """Return numbers of whole trials by condition and name; those of `parts` are seconds."""
    numbers: dict[str, dict[str, Array]] = {}
    for condition, named in value.table().items():
        _check_condition(named, condition, seeds)
        numbers[condition] = {
            f"{SECONDS}{name}" if name in parts else name: _unpack(own, room, len(seeds[condition]))
            for name, own in named.table().items()
        }
    return numbers


def _check_condition(value: JsonValue, name: str, known: Collection[str]) -> None:
    if name not in known:
        raise ValueError(f"{value.key}: is no condition that has seeds")


def _unpack(value: JsonValue, room: Room, n_seeds: int, *most: int) -> Array:
    """Return numbers that `_pack` wrote, ``(n_seeds, ...)``."""
    if isinstance(value.content, dict):
        number = value.child("all").number()
        array = np.full(room.take(value.child("shape"), n_seeds, *most), number)
    elif most:
        array = pad_rows([row.array(1) for row in value.items()] or [np.empty(0)])
    else:
        array = value.array(1)
    return _check_rows(array, value, n_seeds)


def _unpack_rates(value: JsonValue, room: Room, n_seeds: int, most: int) -> Array:
    """Return zeros and ones that `_pack` wrote, ``(n_seeds, n_episodes)``."""
    if isinstance(value.content, dict):
        flags = _bits(value.child("flags"))
        shape = room.take(value.child("shape"), n_seeds, most)
        if len(flags) != math.prod(shape):
            raise value.child("shape").refusal(f"that of {len(flags)} flags")
        return _check_rows(flags.reshape(shape), value, n_seeds)
    rows = [_bits(row) for row in value.items()] or [np.empty(0)]
    return _check_rows(pad_rows(rows), value, n_seeds)


def _bits(value: JsonValue) -> Array:
    text = value.text()
    if {*text} - {"0", "1"}:
        raise value.refusal("text of 0 and 1")
    return np.array(list(map(int, text)))


def _check_rows(array: Array, value: JsonValue, n_seeds: int) -> Array:
    if len(array) != n_seeds or array.size == 0:
        raise value.refusal(f"of {n_seeds} seeds, a row for each")
    return array
