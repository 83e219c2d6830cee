"""Tables of settings laid over each other, and dotted keys into them.

A *table* is a nested dictionary as TOML reads it. Laying one over another replaces values and
descends into tables. Where the two name a different `kind`, the lower one keeps only what both
kinds inherit in common: a trace decay says nothing to a learner that has no trace.
"""

import tomllib
import typing
from collections.abc import Iterator, Mapping
from typing import Any

import tomli_w
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ...core.plugins.registry import Plugged, SettingsRegistry

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
