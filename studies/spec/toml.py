"""Tables of settings written as TOML, which the standard library only reads."""

from collections.abc import Mapping
from typing import Any

import tomli_w


def dumps(table: Mapping[str, Any]) -> str:
    """Return a table as TOML text; entries that are None are left out, as TOML has no word for it.

    Raises
    ------
    TypeError
        If it holds anything but text, numbers, booleans, sequences and tables.

    Examples
    --------
    >>> print(dumps({"seeds": 8, "sweep": {"scenario.box": ("square", "circle")}}), end="")
    seeds = 8
    <BLANKLINE>
    [sweep]
    "scenario.box" = [
        "square",
        "circle",
    ]
    """
    return tomli_w.dumps(_plain(table), multiline_strings=False)


def _plain(value: Any) -> Any:
    """Return tables without what is None, and lists in place of tuples, at any depth."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
