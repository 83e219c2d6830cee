"""Keys of specs, read from the JSON schema of the models that validate specs.

Registered scenarios, learners and so on are included.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple

from ...core.functions.settings import FunctionSettings
from ...core.plugins.settings import Settings
from ...core.plugins.words import expect, near, shallowest
from .conditions import ConditionSettings, Override, StageSettings
from .presets import PRESETS
from .schema import REGISTRIES, KeySchema, Schema
from .spec import Spec
from .tables import flat

UNIT = re.compile(r"\[(m|m/s|m2/s2|1/m|kg|rad|rad/s|s|N per m/s|m/s per m/s)\]")
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
NESTED_LISTS = "/Members"
"""End of the reference to the only schema that refers to itself."""
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
    model: str
    """Name of the settings model; empty for the keys that several models have in common."""
    summary: str
    """The first paragraph of the docstring of the model."""
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


@cache
def tables() -> tuple[Table, ...]:
    """Return every table of a spec, and of each of its kinds.

    Examples
    --------
    >>> by_name = {(table.name, table.kind): table for table in tables()}
    >>> [key.name for key in by_name["scenario", "line-up"].keys]
    ['carts']
    """
    whole = _schema(ConditionSettings)
    return (
        _table("", "", "", _schema(Spec)),
        _table("overrides", "", "", _schema(Override)),
        _table("curriculum", "", "", _schema(StageSettings)),
        *_below("", "", whole, (), (whole["$defs"], set())),
        _table("learner", OWN_FUNCTION, "", _schema(FunctionSettings)),
    )


def _schema(model: type[Settings]) -> Schema:
    return model.model_json_schema(schema_generator=KeySchema)


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
    for table in tables():
        kept = tuple(
            key
            for key, name in zip(table.keys, table.full_names, strict=True)
            if not prefix or f"{name}.".startswith(f"{prefix}.")
        )
        if kept:
            below.append(table._replace(keys=kept))
    return tuple(below)


def nearest(prefix: str) -> str:
    """Return a hint at the keys that an unknown prefix may mean.

    Examples
    --------
    >>> nearest("teammates")
    "did you mean 'learner.decision.teammates'?"
    """
    full = dict.fromkeys(name for table in tables() for name in table.full_names)
    ending = shallowest(name for name in full if name.endswith(f".{prefix}"))
    if ending:
        return f"did you mean {' or '.join(map(repr, ending))}?"
    names = [*dict.fromkeys(table.name for table in tables() if table.name), *full]
    tops = sorted({name.partition(".")[0] for name in full})
    return near(prefix, names) or f"known: {', '.join(tops)}"


Known = tuple[Schema, set[tuple[str, str]]]
"""Schemas by the name to which ``$ref`` refers, and the tables that have been yielded."""


def _below(
    name: str, within: str, table: Schema, above: tuple[str, ...], known: Known
) -> Iterator[Table]:
    """Yield the tables that the keys of a table hold, at any depth, each once.

    Things of a registry are not listed again inside things of the same registry, as the learners of
    the parts of a team are.
    """
    for key, schema in table["properties"].items():
        registry = schema.get("title", "")
        if registry not in above:
            place = f"{name}.{key}".lstrip(".")
            inside = (*above, registry) if registry in REGISTRIES else above
            yield from _tables(place, within, schema, inside, known)


def _tables(
    name: str, within: str, schema: Schema, above: tuple[str, ...], known: Known
) -> Iterator[Table]:
    definitions, seen = known
    new = [own for own in _objects(schema, definitions) if (name, repr(own)) not in seen]
    seen |= {(name, repr(own)) for own in new}
    kinds = [own for own in new if "const" in own["properties"].get("kind", ())]
    common: Schema = {}
    if kinds:
        properties = [own["properties"] for own in kinds]
        common = {
            key: value
            for key, value in properties[0].items()
            if key != "kind" and all(own.get(key) == value for own in properties)
        }
        table = _table(name, "", within, {"properties": common})
        names = [own["kind"]["const"] for own in properties]
        yield table._replace(keys=(_kind(schema, names), *table.keys))
    for own in new:
        rest = {key: v for key, v in own["properties"].items() if key not in common}
        kind = own["properties"]["kind"]["const"] if own in kinds else ""
        if rest:
            yield _table(name, kind, within, {**own, "properties": rest})
        yield from _below(name, kind or within, own, above, known)


def _objects(schema: Schema, definitions: Schema) -> Iterator[Schema]:
    """Yield the schemas of the tables that a key may hold."""
    if "$ref" in schema:
        if schema["$ref"].endswith(NESTED_LISTS):
            return
        schema = definitions[schema["$ref"].rpartition("/")[2]]
    if "properties" in schema and "title" in schema:
        yield schema
    inner = [schema.get(word) for word in ("items", "additionalProperties")]
    for one in [*schema.get("anyOf", ()), *inner]:
        if isinstance(one, Mapping):
            yield from _objects(dict(one), definitions)


def _kind(schema: Schema, kinds: Sequence[str]) -> Key:
    """Return the key ``kind`` of a table."""
    own = "; or your own, file.py:NAME" if schema.get("title") in REGISTRIES else ""
    default = json.dumps((schema.get("default") or {}).get("kind", kinds[0]))
    meaning = "Variant of this table. The other keys depend on it."
    return Key("kind", "text", default, ", ".join(kinds) + own, "", meaning, "")


def _table(name: str, kind: str, within: str, schema: Schema) -> Table:
    preset = dict(flat(PRESETS["default"]))
    if kind not in ("", preset.get(f"{name}.kind")):
        preset = {}
    required = schema.get("required", ())
    keys = []
    for key, own in schema["properties"].items():
        if key == "kind":
            continue
        place = f"{name}.{key}"
        value = preset.get(place, preset.get(f"{place}.kind"))
        keys.append(_key(key, own, value, is_required=key in required))
    summary = schema.get("description", "").partition("\n\n")[0]
    return Table(
        name, kind, within, schema.get("title", ""), " ".join(summary.split()), tuple(keys)
    )


def _key(name: str, schema: Schema, preset: object, *, is_required: bool) -> Key:
    """Return a key with a schema; `preset` is its value in the preset, or None."""
    meaning = schema.get("description", "")
    unit = UNIT.search(meaning)
    default = "required" if is_required else _default(schema.get("default", {}))
    shown = "" if preset is None or json.dumps(preset) == default else json.dumps(preset)
    if schema.get("title") in REGISTRIES:
        kinds = [one["properties"]["kind"].get("const") for one in schema["anyOf"][:-2]]
        type_ = "table"
        allowed = f"kind: {', '.join(kinds)}" if kinds else ""
    else:
        type_ = _type(schema)
        allowed = ", ".join(dict.fromkeys(_allowed(schema)))
    return Key(name, type_, default, allowed, unit[1] if unit else "", meaning, shown)


def _default(value: object) -> str:
    """Return a default as text."""
    if value is None:
        return "none"
    if isinstance(value, Mapping):
        return json.dumps(value["kind"]) if "kind" in value else "{}"
    if value == list(range(8)):
        return "8"  # the seeds, which are written as their number
    return json.dumps(value)


def _type(schema: Schema) -> str:
    """Return the type of a JSON schema in words, without null."""
    if "anyOf" in schema:
        names = [_type(one) for one in schema["anyOf"] if one != {"type": "null"}]
        return " or ".join(dict.fromkeys(names))
    if "$ref" in schema:
        return "nested lists of text" if schema["$ref"].endswith(NESTED_LISTS) else "table"
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
