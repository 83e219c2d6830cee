"""JSON files of other people: parsing, and messages that name the key of a mistake."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Annotated, TypeAlias

from pydantic import PlainValidator, ValidationError

from ...core.plugins.problems import dotted, place, rule
from ...core.plugins.words import show
from ..trials.episodes import MAX_NUMBER

Json: TypeAlias = "dict[str, Json] | list[Json] | str | float | bool | None"
"""Content of a JSON file."""
MAX_WHOLE = 2**53
"""Largest whole number up to which a float holds every whole number."""
CHECKSUM = "sha256"
"""Key of a file's own checksum."""
KEY_PROBLEMS = {
    "missing": "is missing",
    "unexpected_keyword_argument": "is no known key",
    "extra_forbidden": "is no known key",
}
"""Problems of a key, whatever its value, by the type of pydantic's error."""


def read_json(text: str, number: Callable[[str], Json] | None = None) -> Json:
    """Return the content of a JSON text, with numbers as `number` converts their text.

    Raises
    ------
    ValueError, RecursionError
        If the text is no JSON, or a table has a key twice.
    """
    content: Json = json.loads(
        text,
        object_pairs_hook=_distinct,
        parse_float=number,
        parse_int=number,
        parse_constant=number,
    )
    return content


def checksum(table: Mapping[str, object]) -> str:
    """Return the SHA-256 of the content of a JSON file, without its own checksum.

    White space and the notation of numbers do not change it.
    """
    content = {key: value for key, value in table.items() if key != CHECKSUM}
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()


def in_lines(table: Mapping[str, object]) -> str:
    """Return a JSON text with a line for each key, and with its checksum."""
    whole = {**table, CHECKSUM: checksum(table)}
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in whole.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _distinct(pairs: list[tuple[str, Json]]) -> dict[str, Json]:
    table: dict[str, Json] = {}
    for key, value in pairs:
        if key in table:
            raise ValueError(f"{key}: stands twice in a table")
        table[key] = value
    return table


def _finite(value: object) -> float:
    """Return a finite number; whole numbers stay integers."""
    if type(value) is int and abs(value) <= MAX_WHOLE:
        return value
    if type(value) is float and abs(value) <= MAX_NUMBER:
        return value
    raise ValueError("must be a finite number, at most 1e100, or 2**53 if it is whole")


Finite = Annotated[float, PlainValidator(_finite)]
"""A number up to `MAX_NUMBER`, or `MAX_WHOLE` if whole; text and truth values are refused."""


def explain(error: ValidationError, file: Json) -> str:
    """Return the first mistake that pydantic found in a file: key, value, and what is allowed.

    Examples
    --------
    >>> from pydantic import TypeAdapter
    >>> file = {"steps": [30, "6"]}
    >>> try:
    ...     TypeAdapter(dict[str, list[Finite]]).validate_python(file)
    ... except ValidationError as error:
    ...     print(explain(error, file))
    steps[1] = '6': must be a finite number, at most 1e100, or 2**53 if it is whole
    """
    first, *others = error.errors(include_url=False)
    keys = place(first["loc"], file)
    if first["type"] in KEY_PROBLEMS:
        key = first["loc"][-1]
        path = dotted(keys if keys[-1:] == (key,) else (*keys, key))
        return f"{path}: {KEY_PROBLEMS[first['type']]}"
    same = [e["msg"] for e in (first, *others) if place(e["loc"], file) == keys]
    allowed = ", or ".join(dict.fromkeys(map(rule, same)))
    return f"{dotted(keys) or 'the file'} = {show(first['input'])}: {allowed}"
