"""Tables of settings written as TOML, which the standard library only reads."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any


def dumps(table: Mapping[str, Any]) -> str:
    """Return a table as TOML text; entries that are None are left out, as TOML has no word for it.

    Raises
    ------
    TypeError
        If it holds anything but text, numbers, booleans, sequences and tables.

    Examples
    --------
    >>> print(dumps({"seeds": 8, "sweep": {"scenario.box": ["square", "circle"]}}), end="")
    seeds = 8
    <BLANKLINE>
    [sweep]
    "scenario.box" = ["square", "circle"]
    >>> print(dumps({"overrides": [{"name": "a", "learner": {"ridge": 1.0}}]}), end="")
    <BLANKLINE>
    [[overrides]]
    name = "a"
    <BLANKLINE>
    [overrides.learner]
    ridge = 1.0
    """
    return "\n".join(_section(table, ())) + "\n"


def _section(table: Mapping[str, Any], path: tuple[str, ...], opening: str = "[{}]") -> list[str]:
    present = {key: value for key, value in table.items() if value is not None}
    tables = {key: value for key, value in present.items() if isinstance(value, Mapping)}
    lists = {key: value for key, value in present.items() if _is_list_of_tables(value)}
    plain = {key: value for key, value in present.items() if key not in {**tables, **lists}}
    lines = []
    if path and (plain or opening == "[[{}]]" or not {**tables, **lists}):
        lines = ["", opening.format(".".join(map(_key, path)))]
    lines += [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, inner in tables.items():
        lines += _section(inner, (*path, key))
    for key, items in lists.items():
        for item in items:
            lines += _section(item, (*path, key), "[[{}]]")
    return lines


def _is_list_of_tables(value: object) -> bool:
    is_list = isinstance(value, Sequence) and not isinstance(value, str) and len(value) > 0
    return is_list and all(isinstance(item, Mapping) for item in value)  # type: ignore[attr-defined]


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(value: str) -> str:
    # JSON's escapes are TOML's, but for DEL and surrogates, which TOML wants escaped or refuses.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        inner = (f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None)
        return "{" + ", ".join(inner) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    raise TypeError(f"TOML has no form for {type(value).__name__} {value!r}")
