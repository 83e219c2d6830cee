"""Models of a file of results and of its header: keys, limits, and how arrays are written."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Self

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

from ...core.interface.measures import Measure
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import RESULTS_VERSION
from ..store.durable import read_text
from .json_files import Finite, checksum, explain, read_json
from .results import Results, step_limits

HEADER = "study.json"
"""Name of the file that describes the study of exported tables."""
CHANGED = "has been changed since it was exported"
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
    def in_folder_of(cls, path: Path) -> Self | None:
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

    def has_unchanged(self, path: Path) -> bool:
        """Return whether an exported file is there and as it was exported."""
        digest = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
        return self.files.get(path.name) == digest

    def remarks(self, path: Path) -> tuple[str, ...]:
        """Return the notes, and whether an exported file has been changed."""
        notes = tuple(f"{HEADER} {note}" if note == CHANGED else note for note in self.notes)
        known = self.files.get(path.name)
        if known is None and self.files:
            return (*notes, f"is not among the files that {HEADER} lists")
        if known is None or self.has_unchanged(path):
            return notes
        return (*notes, f"{CHANGED}, says {HEADER}")

    def limited(self, results: Results) -> Results:
        """Return results with the limits of the spec."""
        return replace(results, step_limits=step_limits(self.outline.table))


class ResultsFile(Header):
    """Content of a file of results."""

    seeds: dict[str, Seeds]
    phases: dict[str, dict[str, dict[str, Packed]]]
    numbers: dict[str, dict[str, Packed]]
    usage: dict[str, dict[str, Packed]]
    identical: list[list[str]] | None = None
    """Groups of conditions that are identical in every episode, by every measure."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        named = [*self.numbers.values(), *self.usage.values()]
        named += [own for by_condition in self.phases.values() for own in by_condition.values()]
        packed = [a for own in named for a in own.values() if isinstance(a, PackedArray)]
        if sum(math.prod(array.shape) for array in packed) > MAX_VALUES:
            raise ValueError(f"must be small: at most {MAX_VALUES} values may be packed")
        return self
