"""Tables of a spec: merging, dotted keys, and labels of conditions.

A *table* is a nested dictionary as TOML reads it. The label of a condition names its point of the
sweeps.
"""

import hashlib
import itertools
import re
import tomllib
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from ...core.plugins.words import closest, show
from ..errors import SpecError
from ..store.database import SPEC_FILE
from ..store.durable import read_text

SWEEP = "sweep"
"""The table of values to compare."""

TomlTable = dict[str, Any]
SpecTable = Mapping[str, Any]
"""A table of a spec, or a part of one, that is only read: its values are what TOML has."""


def merge(base: SpecTable, table: SpecTable) -> TomlTable:
    """Return `base` updated with `table` at any depth; neither is modified.

    Examples
    --------
    >>> merge({"a": 1, "b": {"c": 2, "d": 3}}, {"b": {"c": 4}})
    {'a': 1, 'b': {'c': 4, 'd': 3}}
    """
    merged = {**base, **table}
    for key in base.keys() & table.keys():
        if isinstance(base[key], Mapping) and isinstance(table[key], Mapping):
            merged[key] = merge(base[key], table[key])
    return merged


def override(base: SpecTable, table: SpecTable) -> TomlTable:
    """Return `base` updated with `table`, where a table of another ``kind`` replaces the one below.

    Examples
    --------
    >>> override({"kind": "tree", "branching": 3}, {"kind": "star"})
    {'kind': 'star'}
    """
    return merge(_without_other_kinds(base, table), table)


def _without_other_kinds(base: SpecTable, table: SpecTable) -> TomlTable:
    if "kind" in base and base["kind"] != table.get("kind", base["kind"]):
        return {}
    pairs = ((key, value, table.get(key)) for key, value in base.items())
    return {
        key: _without_other_kinds(value, other)
        if isinstance(value, Mapping) and isinstance(other, Mapping)
        else value
        for key, value, other in pairs
    }


def nested(key: str, value: object) -> TomlTable:
    """Return the table that holds `value` at a dotted key.

    Examples
    --------
    >>> nested("learner.rule_base.order", 2)
    {'learner': {'rule_base': {'order': 2}}}
    """
    for part in reversed(key.split(".")):
        value = {part: value}
    return typing.cast(TomlTable, value)


def flat(table: SpecTable, prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the dotted key and the value of every entry; tables are descended into, lists not.

    Examples
    --------
    >>> list(flat({"a": {"b": 1}, "c": [2]}))
    [('a.b', 1), ('c', [2])]
    """
    for key, value in table.items():
        if isinstance(value, Mapping) and value:
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def assignment(text: str) -> TomlTable:
    """Read ``key=value`` as TOML would; a bare word as value is a string.

    Raises
    ------
    ValueError
        If `text` is not one assignment.

    Examples
    --------
    >>> assignment("scenario.box = circle"), assignment("seeds=[1, 2]")
    ({'scenario': {'box': 'circle'}}, {'seeds': [1, 2]})
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals and value) or "\n" in text:
        raise ValueError("expected key=value")
    try:
        return tomllib.loads(f"{key} = {value}")
    except tomllib.TOMLDecodeError:
        if any(character in value for character in "\"'[]{}#=, "):
            raise ValueError("the value is not valid TOML") from None
    try:
        return tomllib.loads(f"{key} = '{value}'")
    except tomllib.TOMLDecodeError:
        raise ValueError("the key is not valid TOML") from None


def dumps(table: SpecTable) -> str:
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


def _plain(value: object) -> Any:
    """Return tables without None values and with lists instead of tuples, at any depth."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


LONGEST_TABLE = 40
"""A longer table is not spelled out in labels [characters]."""


def label(point: SpecTable, name: str = "") -> str:
    """Return a short name for a point of the sweeps of an override.

    A value alone is its own label, but a truth value is named after its key.

    Examples
    --------
    >>> label({"preset": "frozen"}), label({"preset": "default", "learner.rule_base.order": 2})
    ('frozen', 'default, order=2')
    >>> label({"scenario.robots": 3}, "no replay")
    'no replay, robots=3'
    >>> label({"learner.self_model.enabled": False}), label({"scenario.numbered": True})
    ('self_model.enabled=false', 'numbered=true')
    """
    if len(point) == 1 and not name:
        [(key, value)] = point.items()
        brief = _brief(value)
        parts = key.split(".")[-2 if key.endswith(".enabled") else -1 :]
        return f"{'.'.join(parts)}={brief}" if brief in ("true", "false") else brief
    last = [key.rpartition(".")[2] for key in point]
    parts = [name] if name else []
    for key, short in zip(point, last, strict=True):
        shown = short if last.count(short) == 1 else key
        value = _brief(point[key])
        parts.append(value if key == "preset" else f"{shown}={value}")
    return ", ".join(parts)


def aliases(condition: str, columns: SpecTable) -> set[str]:
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


def named(name: str, known: Mapping[str, Collection[str]]) -> str | None:
    """Return the one label that a name stands for, by the `aliases` of each; None if none does.

    Examples
    --------
    >>> named("8", {"chain, robots=8": {"8", "robots=8"}, "star": {"star"}})
    'chain, robots=8'
    """
    labels = [label for label, own in known.items() if name in own]
    if name in known:
        return name
    return labels[0] if len(labels) == 1 else None


def key_named(option: str, name: str, keys: Iterable[str]) -> str:
    """Return the key that is called by a name: the whole key, or its last part.

    Raises
    ------
    SpecError
        If there is no such key, or several end so; it names the option.

    Examples
    --------
    >>> key_named("by", "robots", ["scenario.robots", "topology"])
    'scenario.robots'
    """
    known = [*keys]
    ending = [key for key in known if key.rpartition(".")[2] == name]
    if name in known or len(ending) == 1:
        return name if name in known else ending[0]
    hint = f"say which: {', '.join(ending)}" if ending else closest(name, known)
    raise SpecError(f"{option} = {name!r}: {hint}")


def is_named_after(
    by: str, columns: Mapping[str, SpecTable], settings: Mapping[str, SpecTable]
) -> bool:
    """Return whether the names of overrides stand for the values of one key, which is not swept.

    >>> settings = {c: {"topology": {"kind": c}, "steps": 5} for c in ("chain", "star")}
    >>> is_named_after("topology", {c: {"name": c} for c in settings}, settings)
    True
    """
    swept = {key for row in columns.values() for key in row}
    if "name" not in swept or any(by in (key, key.rpartition(".")[2]) for key in swept):
        return False
    known = [dict(flat(settings[c])) for c in columns if c in settings]
    every = {key for own in known for key in own} - swept
    varied = {key for key in every if len({str(own.get(key)) for own in known}) > 1}
    return bool(varied) and all(f".{by}." in f".{key}." for key in varied)


def label_but(columns: SpecTable, keys: Collection[str]) -> str:
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
    text = str(column_value(value))
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


def column_value(value: object) -> object:
    """Return a value for a column: numbers and text unchanged, others in TOML."""
    is_scalar = isinstance(value, int | float | str) and not isinstance(value, bool)
    return value if is_scalar else show(value, width=None)


def spec_text(path: Path) -> str:
    """Return the text of a spec.

    Raises
    ------
    SpecError
        If it cannot be read; of the directory of a study one line names the spec in it.
    """
    try:
        return read_text(path)
    except OSError as error:
        own = path / SPEC_FILE
        hint = f"; the spec of this study is {own}" if own.is_file() else ""
        raise SpecError(f"{path}: {error.strerror or error}{hint}") from None
    except UnicodeDecodeError:
        raise SpecError(f"{path}: is not UTF-8 text") from None


def table_of(text: str, source: str) -> TomlTable:
    """Return the table of a TOML text; the comment at its top becomes the title.

    Raises
    ------
    SpecError
        If the text, which comes from `source`, is no TOML.
    """
    try:
        table = tomllib.loads(text)
    except ValueError as error:  # also of a number of too many digits
        raise SpecError(f"{source}: is not valid TOML: {error}") from None
    comment = first_sentence(text)
    return {"title": comment, **table} if comment else table


SENTENCE_END = re.compile(r"(?<=[?!])\s|(?<!\b[A-Z])(?<!\bet al)(?<!\bFig)(?<!\bEq)\.(?:\s|$)")
"""End of a sentence; a period after an initial, *et al*, *Fig* or *Eq* ends none."""


def first_sentence(text: str) -> str:
    r"""Return the first sentence of the comment at the top of a TOML text; empty without one.

    It does not end after an initial or an abbreviation.

    >>> first_sentence("# A wheel fails: do two robots cope? See Fig. 5.\nstudy = 'scaling'")
    'A wheel fails: do two robots cope?'
    >>> first_sentence("# The chain of J. N. Smith et al. (2010), Fig. 5. Run again.")
    'The chain of J. N. Smith et al. (2010), Fig. 5'
    """
    lines = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    comment = " ".join(line[1:].strip() for line in lines if not line.startswith("#:"))
    return SENTENCE_END.split(comment, maxsplit=1)[0].rstrip(":").strip()
