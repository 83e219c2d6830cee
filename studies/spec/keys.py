"""Keys of specs, read from the settings models and the docstrings of their fields.

Types, defaults and allowed values come from the models that validate a spec, descriptions and units
from the docstrings of their fields. Registered scenarios, learners and so on are included.
"""

import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from pydantic.fields import FieldInfo

from ...core.functions.settings import FunctionSettings
from ...core.plugins.models import kinds_at, models_of
from ...core.plugins.registry import Plugged, SettingsRegistry
from ...core.plugins.settings import Settings
from ...core.plugins.words import expect, near
from .conditions import ConditionSettings, Override, StageSettings
from .docstrings import field_docstring
from .presets import PRESETS
from .schema import Schema, SpecSchema
from .spec import Spec
from .tables import SpecTable

UNIT = re.compile(r"\[(m|m/s|kg|rad|s|N per m/s|m/s per m/s)\]")
"""Unit in the docstring of a field."""
TYPES = {
    "boolean": "true or false",
    "integer": "whole number",
    "number": "number",
    "string": "text",
    "object": "table",
    "": "any",
}
"""Types of JSON schemas in words."""
BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
"""Bounds of JSON schemas in words."""
OWN_FUNCTION = "file.py:decide"
"""Placeholder for functions of users; their keyword-only parameters are further keys."""
MAX_BOUND = 10**9
"""Bounds beyond it are those of machine integers and are not shown."""


class Key(NamedTuple):
    """A key of a table."""

    name: str
    """Name in a spec."""
    type: str
    """In words."""
    default: str
    """Default in TOML; ``none`` or ``required``."""
    allowed: str
    """In words."""
    unit: str
    """Unit; empty if there is none."""
    meaning: str
    """The docstring of the field, in one line; empty if it has none."""
    preset: str
    """Value in the preset `default`, with which a spec starts; empty if it equals the default."""

    @property
    def value(self) -> str:
        """Value if the spec does not set the key, in words."""
        return f"{self.default} (preset default: {self.preset})" if self.preset else self.default


class Table(NamedTuple):
    """A table of a spec, or its keys for one kind."""

    name: str
    """Dotted, as ``learner.rule_base``; empty for the top of a spec."""
    kind: str
    """The ``kind`` of the table with these keys; empty for any."""
    within: str
    """The ``kind`` of the table above it; empty for any."""
    summary: str
    """The first line of the docstring of its model."""
    model: type[Settings]
    """The settings model."""
    keys: tuple[Key, ...]
    """Keys of the table."""

    @property
    def full_names(self) -> tuple[str, ...]:
        """The dotted names of its keys."""
        return tuple(f"{self.name}.{key.name}".lstrip(".") for key in self.keys)

    @property
    def heading(self) -> str:
        """Heading in a spec, such as ``[learner], kind = "frozen"``."""
        kind = f', kind = "{self.kind}"' if self.kind else ""
        within = f', of "{self.within}"' if self.within else ""
        return (f"[{self.name}]" if self.name else "top of the spec") + kind + within


def tables() -> tuple[Table, ...]:
    """Return every table of a spec: its own keys, then those of conditions, kind by kind.

    Examples
    --------
    >>> by_name = {(table.name, table.kind): table for table in tables()}
    >>> [key.name for key in by_name["scenario", "line-up"].keys]
    ['carts']
    """
    own = (("", Spec), ("overrides", Override), ("curriculum", StageSettings))
    heads = [_table(name, ("", ""), model, {}) for name, model in own]
    return (*heads, *_below(ConditionSettings, "", "", set(), ()))


def of_functions() -> Table:
    """Return the table of a learner that is a user's function."""
    return _table("learner", (OWN_FUNCTION, ""), FunctionSettings, {})


def outline() -> dict[str, list[str]]:
    """Return the kinds of each table of a spec, or the names of its keys if it has no kinds."""
    kinds = dict[str, list[str]]()
    keys = dict[str, list[str]]()
    for table in tables():
        kinds.setdefault(table.name, []).extend([table.kind] if table.kind else [])
        keys.setdefault(table.name, []).extend(key.name for key in table.keys)
    return {name: list(dict.fromkeys(kinds[name] or keys[name])) for name in keys}


def keys_below(prefix: str) -> tuple[Table, ...]:
    """Return the tables with names that begin with a dotted prefix, and the matching keys.

    Examples
    --------
    >>> [key.default for table in keys_below("topology.order") for key in table.keys]
    ['"listed"']
    """
    expect("a dotted prefix of keys", str, prefix=prefix)
    below = []
    for table in (*tables(), of_functions()):
        kept = tuple(
            key
            for key, name in zip(table.keys, table.full_names, strict=True)
            if not prefix or f"{name}.".startswith(f"{prefix}.")
        )
        if kept:
            below.append(table._replace(keys=kept))
    return tuple(below)


def _below(
    model: type[Settings],
    name: str,
    within: str,
    seen: set[tuple[str, type[Settings]]],
    above: tuple[SettingsRegistry, ...],
) -> Iterator[Table]:
    """Yield the tables that the fields of a model hold, at any depth, each once.

    Things of a registry are not listed again inside things of the same registry, as the learners of
    the parts of a team are.
    """
    for field, info in model.model_fields.items():
        place = f"{name}.{field}" if name else field
        registry = registry_of(info)
        if registry in above:
            continue
        inside = above if registry is None else (*above, registry)
        for kind, held, inherited in _held(info):
            if (place, held) in seen:
                continue
            seen.add((place, held))
            table = _table(place, (kind, within), held, inherited)
            if not kind and (kinds := kinds_of(info)):
                table = table._replace(keys=(_kind(info, kinds), *table.keys))
            if table.keys or kind:
                yield table
            yield from _below(held, place, kind or within, seen, inside)


def settings_of(info: FieldInfo) -> list[type[Settings]]:
    """Return the settings models that a field's annotation allows, in order."""
    return [model for model in models_of(info.annotation) if issubclass(model, Settings)]


def registry_of(info: FieldInfo) -> SettingsRegistry | None:
    """Return the registry of a field, or None."""
    mark = kinds_at(info)
    return mark.registry if isinstance(mark, Plugged) else None


def kinds_of(info: FieldInfo) -> dict[str, type[Settings]]:
    """Return the models of a field by kind."""
    registry = registry_of(info)
    if registry is not None:
        return {kind: registry.model(kind) for kind in registry.built_in}
    models = settings_of(info)
    return {m.model_fields["kind"].default: m for m in models if "kind" in m.model_fields}


def _held(info: FieldInfo) -> Iterator[tuple[str, type[Settings], Mapping[str, FieldInfo]]]:
    """Yield kind, model and inherited fields for each model of a field, the base model first."""
    registry = registry_of(info)
    kinds = kinds_of(info)
    inherited: Mapping[str, FieldInfo] = {}
    if registry is not None or kinds:
        base = registry.base if registry is not None else _base(list(kinds.values()))
        inherited = base.model_fields
        yield "", base, {}
    for kind, model in kinds.items():
        yield kind, model, inherited if issubclass(model, base) else {}
    if registry is None:
        yield from (("", m, {}) for m in settings_of(info) if "kind" not in m.model_fields)


def _base(models: Sequence[type[Settings]]) -> type[Settings]:
    """Return the nearest common base class of models."""
    ancestors = (cls for cls in models[0].__mro__[1:] if issubclass(cls, Settings))
    return next(cls for cls in ancestors if all(issubclass(m, cls) for m in models))


def _kind(info: FieldInfo, kinds: Iterable[str]) -> Key:
    """Return the key ``kind`` of a table."""
    own = "; or your own, file.py:NAME" if registry_of(info) is not None else ""
    default = "required"
    value = None if info.is_required() else info.get_default(call_default_factory=True)
    if isinstance(value, Settings):
        default = json.dumps(value.model_dump().get("kind", ""))
    meaning = "Kind of the table; the other keys depend on it."
    return Key("kind", "text", default, ", ".join(kinds) + own, "", meaning, "")


def _table(
    name: str, kinds: tuple[str, str], model: type[Settings], base: Mapping[str, FieldInfo]
) -> Table:
    laid = _laid_by_preset(name, kinds[0])
    keys = tuple(
        _key(model, field, laid.get(field))
        for field, info in model.model_fields.items()
        if field != "kind" and not (field in base and base[field].default == info.default)
    )
    summary = (inspect.getdoc(model) or "").partition("\n\n")[0]
    return Table(name, *kinds, " ".join(summary.split()), model, keys)


def _laid_by_preset(name: str, kind: str) -> SpecTable:
    """Return a table of the preset `default` if it has this kind."""
    table: Any = PRESETS["default"].table
    for part in name.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping) or (kind and table.get("kind") != kind):
        return {}
    return table


def nearest(prefix: str) -> str:
    """Return a hint at the keys that an unknown prefix may mean.

    Examples
    --------
    >>> nearest("teammates")
    "did you mean 'learner.decision.teammates'?"
    """
    all_tables = tables()
    full = dict.fromkeys(name for table in all_tables for name in table.full_names)
    names = [*dict.fromkeys(table.name for table in all_tables if table.name), *full]
    ending = [name for name in full if name.endswith(f".{prefix}")]
    if ending:
        return f"did you mean {' or '.join(map(repr, ending))}?"
    tops = sorted({name.partition(".")[0] for name in full})
    return near(prefix, names) or f"known: {', '.join(tops)}"


def _key(model: type[Settings], name: str, laid: object) -> Key:
    """Return a key of a model; `laid` is its value in the preset, or None."""
    info = model.model_fields[name]
    meaning = field_docstring(model, name)
    registry = registry_of(info)
    default = _default(info)
    unit = UNIT.search(meaning)
    if registry is not None:
        type_ = "table"
        allowed = f"kind: {', '.join(registry.built_in)}"
    else:
        own = _properties(model)[name]
        type_ = _type(own)
        allowed = ", ".join(dict.fromkeys(_allowed(own)))
    if isinstance(laid, Mapping):
        laid = laid.get("kind")  # its other keys stand in a table of their own
    preset = "" if laid is None else json.dumps(laid)
    preset = "" if preset == default else preset
    return Key(name, type_, default, allowed, unit[1] if unit else "", meaning, preset)


@cache
def _properties(model: type[Settings]) -> Schema:
    """Return the JSON schema of each key of a model."""
    schema = model.model_json_schema(schema_generator=SpecSchema)
    name = schema.get("$ref", "").rpartition("/")[2]  # a model that may hold itself is a reference
    properties: Schema = (schema["$defs"][name] if name else schema)["properties"]
    return properties


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if value is None:
        return "none"
    if isinstance(value, Settings):
        kind = value.model_dump().get("kind")
        return json.dumps(kind) if kind else "{}"
    if value == tuple(range(8)):
        return "8"  # the seeds, which are written as their number
    return json.dumps(value)


def _type(schema: Schema) -> str:
    """Return the type of a JSON schema in words, without null."""
    if "anyOf" in schema:
        names = [_type(one) for one in schema["anyOf"] if one != {"type": "null"}]
        return " or ".join(dict.fromkeys(names))
    if "$ref" in schema:
        return "nested lists of text" if schema["$ref"].endswith("/Members") else "table"
    if "prefixItems" in schema:
        return f"pair of {_type(schema['prefixItems'][0])}"
    if schema.get("type") == "array":
        return f"list of {_type(schema['items'])}"
    return TYPES[schema.get("type", "")]


def _allowed(schema: Schema) -> Iterator[str]:
    """Yield the bounds and the allowed values in a JSON schema, at any depth."""
    for word, sign in BOUNDS.items():
        if word in schema and abs(schema[word]) <= MAX_BOUND:
            yield f"{sign} {schema[word]:,}"
    for value in [schema["const"]] if "const" in schema else schema.get("enum", []):
        if value is not False:
            yield json.dumps(value)
    if "prefixItems" in schema:
        yield from _allowed(schema["prefixItems"][0])
    elif "items" in schema:
        if "minItems" in schema:
            yield f"at least {schema['minItems']} of them"
        yield from _allowed(schema["items"])
    for one in schema.get("anyOf", []):
        yield from _allowed(one)
