"""Tables of a spec: laid over each other, reached by dotted keys, and what is wrong with one.

A *table* is a nested dictionary as TOML reads it. Laying one over another replaces values and
descends into tables. Where the two name a different `kind`, the lower one keeps only what both
kinds inherit in common: a trace decay says nothing to a learner that has no trace.

What is wrong is said in one line a user can act on: pydantic says where and what; this is turned
into the path as it stands in the spec, the value found there, what is allowed, and the closest
known name. Conditions are called by the point of the sweeps that they are.
"""

import hashlib
import tomllib
import typing
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import tomli_w
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ...core.plugins.registry import Plugged, SettingsRegistry
from ...core.plugins.settings import Keys, closest, dotted, mistaken, near, place, rule
from ..errors import show

TomlTable = dict[str, Any]


Slot = type[BaseModel] | FieldInfo | None
"""What a table is for: a model, or a field that holds one of several."""


def models_of(annotation: Any) -> list[type[BaseModel]]:
    """Return the settings models that a field's annotation allows, in order."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in typing.get_args(annotation) for model in models_of(part)]


def kind_of(model: type[BaseModel]) -> str | None:
    """Return the `kind` by which a table names this model, if it has one."""
    field = model.model_fields.get("kind")
    return None if field is None else field.default or None


def registry_of(slot: Slot) -> SettingsRegistry | None:
    """Return the registry whose things a field holds, if it does."""
    marks = slot.metadata if isinstance(slot, FieldInfo) else []
    return next((mark.registry for mark in marks if isinstance(mark, Plugged)), None)


def model_at(slot: Slot, table: object) -> type[BaseModel] | None:
    """Return the model that `table` is for; none if its kind is unknown or missing."""
    kind = table.get("kind") if isinstance(table, Mapping) else None
    registry = registry_of(slot)
    if registry is not None:
        try:
            return registry.model(str(kind))
        except ValueError:
            return None
    models = models_of(slot.annotation if isinstance(slot, FieldInfo) else slot)
    if len(models) == 1:
        return models[0]
    return next((m for m in models if kind is not None and kind_of(m) == kind), None)


def field_of(model: type[BaseModel] | None, key: str) -> FieldInfo | None:
    """Return the field that a key of a model's table names."""
    return None if model is None else model.model_fields.get(key)


def overlay(base: Mapping[str, Any], table: Mapping[str, Any], slot: Slot = None) -> TomlTable:
    """Return `base` with `table` laid over it; neither is modified.

    Parameters
    ----------
    base, table
        The lower and the upper table.
    slot
        What the result is for. None: plain tables without kinds.

    Examples
    --------
    >>> overlay({"a": 1, "b": {"c": 2, "d": 3}}, {"b": {"c": 4}})
    {'a': 1, 'b': {'c': 4, 'd': 3}}
    """
    result = dict(base)
    if "kind" in base and "kind" in table and base["kind"] != table["kind"]:
        kept = _common_fields(model_at(slot, base), model_at(slot, table))
        result = {key: value for key, value in base.items() if key in kept}
    model = model_at(slot, {**result, **table})
    for key, value in table.items():
        below = result.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping):
            result[key] = overlay(below, value, field_of(model, key))
        elif isinstance(value, str) and isinstance(below, Mapping) and "kind" in below:
            # A name stands for a table that says its kind and no more.
            result[key] = {"kind": value} if registry_of(field_of(model, key)) else value
        else:
            result[key] = value
    return result


def _common_fields(first: type[BaseModel] | None, second: type[BaseModel] | None) -> set[str]:
    if first is None or second is None:
        return set()
    shared = next(c for c in first.__mro__ if issubclass(second, c) and issubclass(c, BaseModel))
    return set(shared.model_fields)


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


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
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


def explain(
    error: ValidationError,
    model: type[BaseModel],
    data: Mapping[str, Any],
    below: tuple[type[BaseModel], Mapping[str, Any]] | None = None,
) -> str:
    """Return one line on the first thing that `error` found wrong with `data`.

    Parameters
    ----------
    error
        What pydantic raised when it validated `data` as `model`.
    model
        The model of the outermost table.
    data
        The table as the user gave it.
    below
        Model and table of all that a misplaced key may belong to; none: `model` and `data`.
    """
    problems = [(place(e["loc"], data), e) for e in error.errors(include_url=False)]
    # Where a name or a table may stand and a table does, what is wrong is in the table.
    start = problems[0][0]
    inside = [f for f in problems if len(f[0]) > len(start) and f[0][: len(start)] == start]
    (keys, first) = (inside or problems)[0]
    path = dotted(keys) or "spec"
    if first["type"] == "extra_forbidden":
        owner = model_at(*_reach(keys[:-1], model, data))
        kind = f" for kind {kind_of(owner)!r}" if owner is not None and kind_of(owner) else ""
        known = set() if owner is None else set(owner.model_fields)
        misspelt = near(keys[-1], known, cutoff=0.85)
        hint = misspelt or misplaced(path, *(below or (model, data))) or closest(keys[-1], known)
        return f"{path} = {show(first['input'])}: unknown key{kind}; {hint}"
    if first["type"] == "missing":
        name = str(first["loc"][-1])
        return f"{path}: missing" if keys == (name,) else f"{path}.{name}: missing"
    value = first["input"]
    if first["type"] == "plugged_kind":
        return f"{_kind(path, value)}{first['msg']}"
    if first["type"].startswith("union_tag"):
        slot, _ = _reach(keys, model, data)
        kinds = [kind_of(m) for m in models_of(getattr(slot, "annotation", slot))]
        kind = value.get("kind")
        hint = closest(kind, [k for k in kinds if k]) + _pointer(keys, kind, model, data)
        return f"{_kind(path, value)}{hint}"
    # The members of a union complain one by one about the same place: say what any would take.
    text = ", or ".join(dict.fromkeys(rule(e["msg"]) for there, e in problems if there == keys))
    owner = model_at(*_reach(keys[:-1], model, data)) if keys else None
    is_other_type = ("string" in text) is not isinstance(value, str)
    other = mistaken(keys[-1], owner.model_fields, first) if owner and is_other_type else ""
    return f"{path} = {show(value)}: {text}{other or _pointer(keys, value, model, data)}"


def _kind(path: str, value: object) -> str:
    """Return how a line begins on the kind of a table, or on the name that stands for one."""
    if isinstance(value, Mapping) and "kind" in value:
        return f"{path}.kind = {show(value['kind'])}: "
    return f"{path} = {show(value)}: " + "kind is missing; " * isinstance(value, Mapping)


def _pointer(keys: Keys, value: object, model: type[BaseModel], data: Mapping[str, Any]) -> str:
    """Return "; did you mean ...?" if a key of the same name in another table takes a word."""
    places = _places(str(keys[-1]), model, data) if keys and isinstance(value, str) else ()
    match = next((n for n, field in places if value in typing.get_args(field.annotation)), None)
    return f"; did you mean {match} = {value!r}?" if match and match != dotted(keys) else ""


def misplaced(path: str, model: type[BaseModel], data: Mapping[str, Any]) -> str:
    """Return "did you mean ...?" if the last part of a dotted key is a key of some other table.

    Parameters
    ----------
    path
        The key as it stands in the spec.
    model
        The model whose tables are looked through, at any depth.
    data
        The table that it is of, as the user gave it: where it says a kind, no others are looked
        through.
    """
    key = path.rpartition(".")[2]
    places = (name for name, _ in _places(key, model, data) if not f".{path}".endswith(f".{name}"))
    matches = dict.fromkeys(places)
    return f"did you mean {' or '.join(map(repr, matches))}?" if matches and key != "kind" else ""


def _places(
    key: str, model: type[BaseModel], data: object, name: str = ""
) -> Iterator[tuple[str, FieldInfo]]:
    """Yield the dotted names that a key has in the tables below a model, and its fields."""
    for field, info in model.model_fields.items():
        table = data.get(field) if isinstance(data, Mapping) else None
        registry, own = registry_of(info), model_at(info, table)
        if own is not None:
            held = [own]
        elif registry is None:
            held = models_of(info.annotation)
        else:
            held = [registry.model(kind) for kind in registry.built_in]
        for inner in held:
            if key in inner.model_fields:
                yield f"{name}{field}.{key}", inner.model_fields[key]
            yield from _places(key, inner, table, f"{name}{field}.")


def _reach(
    keys: Sequence[int | str], model: type[BaseModel], data: Mapping[str, Any]
) -> tuple[Slot, Any]:
    """Return the model or field that the value at `keys` is for, and the value."""
    slot: Slot = model
    value: Any = data
    for key in keys:
        if isinstance(key, str):  # an item of a list is one of the models that the list may hold
            slot = field_of(model_at(slot, value), key)
        value = value[key]
    return slot, value


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
