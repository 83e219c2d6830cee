"""How conditions are called, by the point of the sweeps that they are, and how long they train."""

import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from ..errors import show

LONGEST_TABLE = 40
"""A longer table is not spelled out in labels [characters]."""


def label(point: Mapping[str, Any], name: str = "") -> str:
    """Return a short name for a point of the sweeps of an override.

    Examples
    --------
    >>> label({"preset": "frozen"}), label({"preset": "default", "learner.rule_base.order": 2})
    ('frozen', 'default, order=2')
    >>> label({"scenario.robots": 3}, "no replay")
    'no replay, robots=3'
    """
    if len(point) == 1 and not name:
        return _brief(next(iter(point.values())))
    last = [key.rpartition(".")[2] for key in point]
    parts = [name] if name else []
    for key, short in zip(point, last, strict=True):
        shown = short if last.count(short) == 1 else key
        value = _brief(point[key])
        parts.append(value if key == "preset" else f"{shown}={value}")
    return ", ".join(parts)


def aliases(condition: str, columns: Mapping[str, Any]) -> set[str]:
    """Return all that a condition may be called by: its label, its columns with and without keys.

    Examples
    --------
    >>> sorted(aliases("8", {"scenario.robots": 8, "topology": ""}))
    ['8', 'robots=8', 'scenario.robots=8']
    """
    own = {key: str(value) for key, value in columns.items() if value != ""}
    spelt = [list(own.values())]
    for keys in (own, [key.rpartition(".")[2] for key in own]):
        spelt.append([f"{key}={value}" for key, value in zip(keys, own.values(), strict=True)])
    return {condition, *map(", ".join, spelt)}


def label_but(columns: Mapping[str, Any], keys: Collection[str]) -> str:
    """Return the label that a condition of these columns would have without some swept keys.

    Examples
    --------
    >>> label_but({"name": "no replay", "scenario.robots": 3, "topology": ""}, ["scenario.robots"])
    'no replay'
    """
    point = {k: v for k, v in columns.items() if k not in (*keys, "name") and v != ""}
    return label(point, columns.get("name", ""))


def _brief(value: object) -> str:
    """Return a value for a label.

    A table is called by its name; a long one without is distinguished by a checksum, as is
    a list that is cut.

    Examples
    --------
    >>> kite = {"vertices": [[0, 0], [0.2, 0.1], [0.3, 0], [0.2, -0.1]]}
    >>> _brief({"name": "kite", **kite}), _brief(kite), _brief({"branching": 2})
    ('kite', 'described e5dea0', '{branching = 2}')
    """
    text = str(scalar(value))
    if isinstance(value, Mapping):
        if "name" in value:
            return str(value["name"])
        kind = value.get("kind", "described")
        return text if len(text) <= LONGEST_TABLE else f"{kind} {_checksum(text)}"
    if isinstance(value, str) or len(text) <= 60:
        return text
    return f"{text[:50]}... {_checksum(text)}"


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()[:6]


def scalar(value: object) -> object:
    """Return a value as it stands in a column: a number or text as it is, else in TOML."""
    is_scalar = isinstance(value, int | float | str) and not isinstance(value, bool)
    return value if is_scalar else show(value, width=None)


def lengths(curricula: Iterable[Sequence[int]], episodes: int) -> str:
    """Return in words the episodes of training, stage by stage, that there are.

    Parameters
    ----------
    curricula
        Of every condition, the episodes of its stages.
    episodes
        Those after them.

    Examples
    --------
    >>> lengths([[10, 6], [10, 6]], 8), lengths([[10, 6], []], 8), lengths([[]], 1)
    ('10 + 6 + 8 episodes', '10 + 6 + 8 or 8 episodes', '1 episode')
    """
    sums = dict.fromkeys(" + ".join(map(str, [*stages, episodes])) for stages in curricula)
    return f"{' or '.join(sums)} episode{'' if list(sums) == ['1'] else 's'}"
