"""Headers of exported files: version, spec, swept keys and measures of a study, with checksums.

A header begins the JSON file of results. For other exported files it is a file of its own,
``study.json``, which lists their checksums.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import NamedTuple, Self, get_args

from ...core.interface.measures import Measure
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..store.database import RESULTS_VERSION, tables
from ..store.durable import read_text
from .exported import Description
from .json_values import CHECKSUM, JsonValue, checksum, parse
from .results import Results, StepLimits

GATHERINGS = get_args(Measure.__annotations__["gathering"])
"""Ways in which the steps of an episode make one number."""
HEADER = "study.json"
"""Name of the file that describes the study of exported tables."""
KEYS = (
    "results_version",
    "spec",
    "columns",
    "measures",
    "seeds",
    "phases",
    "numbers",
    "usage",
    "files",
    CHECKSUM,
)
"""Keys of the files."""
CHANGED = "has been changed since it was exported"
MOST_SEEDS = 100_000
"""Largest number of seeds of a condition."""
MOST_EPISODES = 1_000_000
"""Largest number of episodes of a trial."""
MOST_VERSION = 1_000_000
"""Larger than any version of results will be."""


def in_lines(content: Mapping[str, object]) -> str:
    """Return a JSON text with a line for each key, and with its checksum."""
    whole = {**content, CHECKSUM: checksum(content)}
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in whole.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def describe(
    outline: StudyOutline, results: Results, files: Mapping[str, bytes], folder: Path
) -> bytes:
    """Return the content of the file that describes exported files by name.

    It also lists the files of the same study in another form that were exported to the folder.
    """
    described = json.loads(json.dumps(header(outline, results)))
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    with suppress(OSError, ValueError, RecursionError):
        there = parse(read_text(folder / HEADER)).content
        if there[CHECKSUM] == checksum(there) and there.items() >= described.items():
            digests = there["files"] | digests
    return in_lines({**described, "files": digests}).encode()


def extends(path: Path, content: bytes) -> bool:
    """Return whether a content is that of a file, or lists more files of the same study."""
    there = path.read_bytes()
    if path.name != HEADER or there == content:
        return there == content
    with suppress(ValueError, RecursionError, AttributeError, KeyError):
        (old, listed), (new, more) = (_without_files(text) for text in (there, content))
        return bool(old == new and listed.items() <= more.items())
    return False


def _without_files(text: bytes) -> tuple[dict[str, object], dict[str, str]]:
    """Return the description of a study, and the checksums of files that it lists."""
    table = json.loads(text)
    del table[CHECKSUM]
    return table, table.pop("files")


def header(outline: StudyOutline, results: Results) -> dict[str, object]:
    """Return the description of a study: version, spec, swept keys, measures."""
    return {
        "results_version": RESULTS_VERSION,
        "spec": outline.table,
        "columns": {c: results.columns.get(c, {}) for c in results.conditions},
        "measures": tables(m for m in results.measures if m.name in results.episodes),
    }


class Header(NamedTuple):
    """Content of `header`."""

    outline: StudyOutline
    columns: dict[str, dict[str, str | float | bool | None]]
    measures: tuple[Measure, ...]
    version: int
    digests: Mapping[str, str]
    """SHA-256 by name of the files that were exported with it."""
    notes: tuple[str, ...]
    """Notes on results of another version than this, and on changed files."""
    is_listed: bool = False
    """Whether the file beside it that is read is one of these."""

    def beside(self, path: Path) -> Self:
        """Return the header with its notes on a file in the same folder."""
        notes = tuple(f"{HEADER} {note}" if note == CHANGED else note for note in self.notes)
        known = self.digests.get(path.name)
        if known is None and self.digests:
            notes = (*notes, f"is not among the files that {HEADER} lists")
        elif known not in (None, hashlib.sha256(path.read_bytes()).hexdigest()):
            notes = (*notes, f"{CHANGED}, says {HEADER}")
        return self._replace(notes=notes, is_listed=known is not None)

    def limited(self, results: Results) -> Results:
        """Return results with the limits of the spec."""
        return replace(results, step_limits=StepLimits.of(self.outline.table))

    @property
    def description(self) -> Description:
        """Description for reading exported tables."""
        return Description(self.columns, self.measures)

    @classmethod
    def of(cls, file: JsonValue) -> Header:
        """Return the header of a file.

        Raises
        ------
        ValueError
            If the file has none.
        """
        for name, value in file.table().items():
            if name not in KEYS:
                raise ValueError(f"{value.key}: unknown key; {closest(name, KEYS)}")
        version = file.child("results_version").whole(1, MOST_VERSION)
        columns = _columns(file.child("columns"))
        outline = _outline(file.child("spec"), columns)
        listed = file.table().get("files", JsonValue({}))
        digests = {name: own.text() for name, own in listed.table().items()}
        measures = _measures(file.child("measures"))
        notes: list[str] = []
        if version != RESULTS_VERSION:
            notes.append(f"results of version {version}, this is version {RESULTS_VERSION}")
        if file.content.get(CHECKSUM) not in (None, checksum(file.content)):
            notes.append(CHANGED)
        return cls(outline, columns, measures, version, digests, tuple(notes))


def header_beside(path: Path) -> Header | None:
    """Return the header in the folder of a file; None if no study was exported there.

    Raises
    ------
    SpecError
        If it is damaged.
    """
    place = path.with_name(HEADER)
    if not place.is_file():
        return None
    try:
        file = parse(read_text(place))
        is_own = isinstance(file.content, dict) and not {"results_version", "files"}.isdisjoint(
            file.content
        )
        return Header.of(file).beside(path) if is_own else None
    except (OSError, ValueError, RecursionError) as error:
        raise SpecError(f"{place}: describes no exported study: {error}") from None


def _outline(spec: JsonValue, columns: Mapping[str, Mapping[str, object]]) -> StudyOutline:
    """Return the outline of a spec, which is read where a page or a table names it."""
    spec.child("study").text()
    seeds_of(spec.child("seeds"))
    for name in ("episodes", "steps", "evaluation"):
        spec.child(name).whole(0, MOST_EPISODES)
    own = spec.table()
    if "evaluation_steps" in own:
        own["evaluation_steps"].whole(1, MOST_EPISODES)
    overrides = own["overrides"].items() if "overrides" in own else []
    for part in (spec, *overrides):
        if "curriculum" in part.table():
            for stage in part.child("curriculum").items():
                stage.child("episodes").whole(0, MOST_EPISODES)
    return StudyOutline.noted(spec.content, columns)


def seeds_of(value: JsonValue) -> tuple[int, ...]:
    """Return the seeds of a spec, which may be written as their number."""
    if not isinstance(value.content, list):
        return tuple(range(value.whole(1, MOST_SEEDS)))
    seeds = tuple(seed.whole(0, 2**63 - 1) for seed in value.items())
    if not 1 <= len(seeds) <= MOST_SEEDS:
        raise value.refusal(f"a list of 1 to {MOST_SEEDS} seeds")
    if len(set(seeds)) < len(seeds):
        raise value.refusal("a list of distinct seeds")
    return seeds


def _columns(value: JsonValue) -> dict[str, dict[str, str | float | bool | None]]:
    """Return what tells the conditions apart, texts and numbers."""
    columns = {name: row.table() for name, row in value.table().items()}
    for row in columns.values():
        for own in row.values():
            if isinstance(own.content, int | float) and not isinstance(own.content, bool):
                own.number()
            elif own.content is not None and not isinstance(own.content, str | bool):
                raise own.refusal("text, a number, true or false")
    return {name: {key: own.content for key, own in row.items()} for name, row in columns.items()}


def _measures(value: JsonValue) -> tuple[Measure, ...]:
    measures = tuple(_measure(table) for table in value.items())
    names = [measure.name for measure in measures]
    if len({*names, "steps", "return"}) < len(names) + 2:
        raise value.refusal("of distinct names, none of them steps or return")
    return measures


def _measure(value: JsonValue) -> Measure:
    table = value.table()
    known = {field.name for field in fields(Measure)}
    for name, own in table.items():
        if name not in known:
            raise ValueError(f"{own.key}: known: {', '.join(sorted(known))}")
    for name in ("name", "title", "unit", "source"):
        if name in table or name in ("name", "title"):
            value.child(name).text()
    for name in ("least", "greatest"):
        if name in table and table[name].content is not None:
            table[name].number()
    if "gathering" in table:
        table["gathering"].text(GATHERINGS)
    if "better" in table and table["better"].content is not None:
        table["better"].text(("higher", "lower"))
    if "is_rate" in table:
        table["is_rate"].flag()
    return Measure(**value.content)
