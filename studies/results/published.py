"""Results of a study as one small JSON file, with spec and seeds, fit to be committed or published.

Rates are kept as one character an episode, other measures with every digit. Returns are left out
unless they are what is compared. Claims are always decided by results in this form, so the
committed files give the table that the run gave.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    ValidationError,
    WrapValidator,
    model_validator,
)

from ...core.interface.measures import RETURN, Measure
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import RESULTS_VERSION, tables
from ..store.database import SECONDS as PARTS
from ..store.durable import read_text
from .json_files import Finite, checksum, explain, in_lines, read_json
from .results import SECONDS, Array, Results, StepLimits, from_arrays, pad_rows

HEADER = "study.json"
"""Name of the file that describes the study of exported tables."""
CHANGED = "has been changed since it was exported"
FEW = 100
"""Fewer rows, or values, are always written one by one."""
MAX_SEEDS = 100_000
"""Largest number of seeds of a condition."""
MAX_EPISODES = 1_000_000
"""Largest number of episodes of a trial."""
MAX_VERSION = 1_000_000
"""Largest version of results."""
MAX_VALUES = 20_000_000
"""Largest number of values of a file that are written as one for all or as text.

Some characters could otherwise fill any memory."""


def _spell_out(seeds: object) -> object:
    """Return the list of the seeds from 0 on that are written as their number."""
    if type(seeds) is not int:
        return seeds
    if not 1 <= seeds <= MAX_SEEDS:
        raise ValueError(f"must be a whole number from 1 to {MAX_SEEDS}, or a list")
    return list(range(seeds))


def _check_distinct(seeds: list[int]) -> list[int]:
    if len({*seeds}) < len(seeds):
        raise ValueError("must be a list of distinct seeds")
    return seeds


def _check_measures(measures: tuple[Measure, ...]) -> tuple[Measure, ...]:
    names = {measure.name for measure in measures}
    if len(names | {"steps", "return"}) < len(measures) + 2:
        raise ValueError("must be of distinct names, none of them steps or return")
    return measures


Count = Annotated[int, Field(ge=0, le=MAX_EPISODES)]
Seeds = Annotated[
    list[Annotated[int, Field(ge=0, lt=2**63)]],
    BeforeValidator(_spell_out),
    Field(min_length=1, max_length=MAX_SEEDS),
    AfterValidator(_check_distinct),
]
Bits = Annotated[str, Field(pattern="^[01]*$")]
"""Zeros and ones of the episodes of a seed."""
Side = Annotated[int, Field(ge=1, le=MAX_EPISODES)]


class PackedArray(BaseModel):
    """An array as one value for all, or as the text of its zeros and ones."""

    all: Finite | None = None
    flags: Bits | None = None
    shape: Annotated[list[Side], Field(min_length=1, max_length=2)]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.all is None) is (self.flags is None):
            raise ValueError("must have either all or flags")
        if self.flags is not None and len(self.flags) != math.prod(self.shape):
            raise ValueError(f"must have the shape of its {len(self.flags)} flags")
        return self


def _form_of(value: object) -> str:
    """Return the tag of the form in which an array is written."""
    if isinstance(value, dict):
        return "packed array"
    first = value[0] if isinstance(value, list) and value else None
    if isinstance(first, str):
        return "texts"
    return "rows" if isinstance(first, list) else "numbers"


Packed = Annotated[
    Annotated[PackedArray, Tag("packed array")]
    | Annotated[list[Bits], Tag("texts")]
    | Annotated[list[list[Finite]], Tag("rows")]
    | Annotated[list[Finite], Tag("numbers")],
    Discriminator(_form_of),
]
"""An array as JSON: numbers of seeds, rows of numbers or texts of bits, or packed."""


class CurriculumStage(BaseModel):
    """Stage of a curriculum."""

    episodes: Count


class ConditionKeys(BaseModel):
    """Keys of a condition that pages read."""

    curriculum: list[CurriculumStage] = []


class SpecKeys(ConditionKeys):
    """Keys of a spec that tables and pages read."""

    study: str
    seeds: Seeds
    episodes: Count
    steps: Count
    evaluation: Count
    evaluation_steps: Annotated[int, Field(ge=1, le=MAX_EPISODES)] | None = None
    overrides: list[ConditionKeys] = []


def _keep(table: object, validate: Callable[[object], SpecKeys]) -> object:
    """Return a spec as it is, after its keys were validated."""
    validate(table)
    return table


class Header(BaseModel):
    """Description of a study: what its files say besides numbers."""

    model_config = ConfigDict(extra="forbid")
    results_version: Annotated[int, Field(ge=1, le=MAX_VERSION)]
    spec: Annotated[SpecKeys, WrapValidator(_keep)]
    """The whole spec as a table."""
    columns: dict[str, dict[str, str | bool | Finite | None]]
    """Swept keys by condition, in the order of the study."""
    measures: Annotated[tuple[Measure, ...], AfterValidator(_check_measures)]
    files: dict[str, str] = {}
    """SHA-256 of the exported files in its folder, by name."""
    sha256: str | None = None
    """Checksum of its own file."""
    _is_changed: bool = PrivateAttr(default=False)

    @classmethod
    def of(cls, text: str) -> Self:
        """Return what the text of a JSON file says.

        Raises
        ------
        ValueError, RecursionError
            If it is something else; one line names the key, its value and what is allowed.
        """
        file = read_json(text)
        try:
            header = cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            raise ValueError(explain(error, file)) from None
        if isinstance(file, dict):
            header._is_changed = header.sha256 is not None and header.sha256 != checksum(file)
        return header

    @classmethod
    def beside(cls, path: Path) -> Self | None:
        """Return the header in the folder of an exported file; None if there is none.

        Raises
        ------
        SpecError
            If it is damaged.
        """
        place = path.with_name(HEADER)
        if not place.is_file():
            return None
        try:
            text = read_text(place)
            file = read_json(text)
            is_own = isinstance(file, dict) and not {"results_version", "files"}.isdisjoint(file)
            return cls.of(text) if is_own else None
        except (OSError, ValueError, RecursionError) as error:
            raise SpecError(f"{place}: describes no exported study: {error}") from None

    @property
    def outline(self) -> StudyOutline:
        """Outline of the study."""
        return StudyOutline.noted(dict(self.spec), self.columns)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on results of another version than this, and on a changed file."""
        other = f"results of version {self.results_version}, this is version {RESULTS_VERSION}"
        is_other = self.results_version != RESULTS_VERSION
        return (*[other] * is_other, *[CHANGED] * self._is_changed)

    def remarks(self, path: Path) -> tuple[str, ...]:
        """Return the notes, and whether an exported file has been changed."""
        notes = tuple(f"{HEADER} {note}" if note == CHANGED else note for note in self.notes)
        known = self.files.get(path.name)
        if known is None and self.files:
            return (*notes, f"is not among the files that {HEADER} lists")
        if known is None or known == hashlib.sha256(path.read_bytes()).hexdigest():
            return notes
        return (*notes, f"{CHANGED}, says {HEADER}")

    def limited(self, results: Results) -> Results:
        """Return results with the limits of the spec."""
        return replace(results, step_limits=StepLimits.of(self.outline.table))


class ResultsFile(Header):
    """Content of a file of results."""

    seeds: dict[str, Seeds]
    phases: dict[str, dict[str, dict[str, Packed]]]
    numbers: dict[str, dict[str, Packed]]
    usage: dict[str, dict[str, Packed]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        named = [*self.numbers.values(), *self.usage.values()]
        named += [own for by_condition in self.phases.values() for own in by_condition.values()]
        packed = [a for own in named for a in own.values() if isinstance(a, PackedArray)]
        if sum(math.prod(array.shape) for array in packed) > MAX_VALUES:
            raise ValueError(f"must be small: at most {MAX_VALUES} values may be packed")
        return self


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
    file = ResultsFile.of(text)
    for condition in file.seeds:
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
    return Published(file.outline, file.limited(results), file.results_version, file.notes)


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
