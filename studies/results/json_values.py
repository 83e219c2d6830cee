"""Values of a foreign JSON file with their keys.

Every access checks the type; `ValueError` names the key, the value and what is allowed.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from ...core.plugins.words import show

MOST_WHOLE = 2**53
"""Up to here a float holds every whole number."""
CHECKSUM = "sha256"
"""Key of a file's own checksum."""
LARGEST = {"i": MOST_WHOLE, "u": MOST_WHOLE, "f": np.finfo(float).max}
"""The largest value of an array, by the kind of its numbers."""


class JsonValue(NamedTuple):
    """A value with its key.

    Examples
    --------
    >>> value = parse('{"runs": [{"steps": 3}, {"steps": "3"}]}')
    >>> first, second = value.child("runs").items()
    >>> first.child("steps").whole()
    3
    >>> second.child("steps").whole()
    Traceback (most recent call last):
    ...
    ValueError: runs[1].steps = '3': must be a whole number from 0 to 9007199254740992
    """

    content: Any
    """Value as `json` reads it."""
    key: str = ""
    """Path of the value in the file; empty for the whole file."""

    def refusal(self, allowed: str) -> ValueError:
        """Return the error that says what it is, and what is allowed."""
        return ValueError(f"{self.key or 'the file'} = {show(self.content)}: must be {allowed}")

    def table(self) -> dict[str, JsonValue]:
        """Return the values of a table by name."""
        if not isinstance(self.content, dict):
            raise self.refusal("a table")
        before = f"{self.key}." if self.key else ""
        return {name: JsonValue(own, f"{before}{name}") for name, own in self.content.items()}

    def child(self, name: str) -> JsonValue:
        """Return a required value of a table."""
        own = self.table()
        if name not in own:
            raise ValueError(f"{self.key + '.' if self.key else ''}{name}: is missing")
        return own[name]

    def items(self) -> list[JsonValue]:
        """Return the values of a list."""
        if not isinstance(self.content, list):
            raise self.refusal("a list")
        return [JsonValue(own, f"{self.key}[{i}]") for i, own in enumerate(self.content)]

    def text(self, allowed: Iterable[str] = ()) -> str:
        """Return the value as text, one of `allowed` if any are given."""
        known = list(allowed)
        if not isinstance(self.content, str):
            raise self.refusal("text")
        if known and self.content not in known:
            raise self.refusal(f"one of {', '.join(known)}")
        return self.content

    def flag(self) -> bool:
        """Return whether it is true."""
        if not isinstance(self.content, bool):
            raise self.refusal("true or false")
        return self.content

    def whole(self, least: int = 0, most: int = MOST_WHOLE) -> int:
        """Return the value as a whole number."""
        content = self.content
        is_whole = isinstance(content, int) and not isinstance(content, bool)
        if not is_whole or not least <= content <= most:
            raise self.refusal(f"a whole number from {least} to {most}")
        return int(content)

    def number(self) -> float:
        """Return the value as a finite number; whole numbers stay integers."""
        content = self.content
        if isinstance(content, bool) or not isinstance(content, int | float):
            raise self.refusal("a finite number")
        if (isinstance(content, int) and abs(content) > MOST_WHOLE) or not math.isfinite(content):
            raise self.refusal("a finite number")
        return content

    def array(self, dimensions: int) -> NDArray[Any]:
        """Return lists in lists of finite numbers, rows of equal length, as an array."""
        rows = self.content
        flat = [rows]
        for _ in range(dimensions):
            if not all(isinstance(part, list) for part in flat):
                self._refuse_part(dimensions)
            flat = list(chain.from_iterable(flat))
        if not set(map(type, flat)) <= {int, float}:
            self._refuse_part(dimensions)
        try:
            array = np.array(rows)
        except ValueError:
            raise self.refusal("rows of equal length") from None
        # A whole number beyond those of a machine makes an array of objects.
        if array.dtype == object or not (abs(array) <= LARGEST[array.dtype.kind]).all():
            self._refuse_part(dimensions)
        return array

    def _refuse_part(self, dimensions: int) -> NoReturn:
        """Name the first of the values in lists in lists that is no finite number."""
        values = [self]
        for _ in range(dimensions):
            values = [item for value in values for item in value.items()]
        for value in values:
            value.number()
        raise self.refusal("finite numbers")


def checksum(table: Mapping[str, object]) -> str:
    """Return the SHA-256 of the content of a JSON file, without its own checksum.

    White space and the notation of numbers do not change it.
    """
    content = {name: value for name, value in table.items() if name != CHECKSUM}
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()


def parse(text: str) -> JsonValue:
    """Return the value of a JSON text.

    Raises
    ------
    ValueError, RecursionError
        If it is no JSON, or a table has a key twice.
    """
    return JsonValue(read_json(text))


def read_json(text: str, number: Callable[[str], object] | None = None) -> Any:
    """Return what a JSON text holds; numbers as `number` makes them of their text, if it is given.

    Raises
    ------
    ValueError, RecursionError
        If it is no JSON, or a table has a key twice.
    """
    return json.loads(
        text,
        object_pairs_hook=_table,
        parse_float=number,
        parse_int=number,
        parse_constant=number,
    )


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        names = _repeated(name for name, _ in pairs)
        raise ValueError(f"{next(names)}: stands twice in a table")
    return table


def _repeated(names: Iterable[str]) -> Iterator[str]:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            yield name
        seen.add(name)
