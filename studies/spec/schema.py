"""JSON schema of specs, with which editors complete and check them.

It is derived from the models that validate specs, like `keys`. Tables of a spec override a preset,
so that they require no key that a preset may have. A table without a ``kind`` may have the keys of
any kind, one with a built-in kind the keys of this kind, and one with a user's kind any keys.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BeforeValidator, PlainValidator, TypeAdapter, WrapValidator
from pydantic.fields import FieldInfo

from ...core.plugins.settings import Settings
from ...core.plugins.words import closest, expect
from ..errors import SpecError
from .conditions import ConditionSettings, Override, StageSettings
from .keys import kinds_of, meaning, registry_of, settings_of
from .presets import PRESETS
from .spec import Spec
from .studies import STUDIES

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
OPEN = BeforeValidator, PlainValidator, WrapValidator
"""Validators that may accept other values than the type of the field."""
NUMBERS: Schema = {"type": "array", "items": {"type": "integer", "minimum": 0}}
LISTS: Schema = {"$ref": "#/$defs/lists"}
LIST: Schema = {"anyOf": [{"type": "array"}, LISTS]}


class SchemaWriter:
    """Writes the schemas of models and fields; those of tables stand in `definitions` once."""

    def __init__(self) -> None:
        self.definitions: dict[str, Schema] = {
            "lists": {"type": "object", "additionalProperties": LIST}
        }

    def table(self, model: type[Settings], *, is_whole: bool = True) -> Schema:
        """Return the schema of a model's table; `is_whole`, what must be given is required."""
        known = {
            name: self.field(model, name, info)
            for name, info in model.model_fields.items()
            if name != "kind"
        }
        required = [n for n, i in model.model_fields.items() if is_whole and i.is_required()]
        schema: Schema = {"type": "object", "properties": known, "additionalProperties": False}
        return schema | ({"required": required} if required else {})

    def field(self, model: type[Settings], name: str, info: FieldInfo) -> Schema:
        """Return the schema of a field, with its text."""
        text = meaning(model, name)
        schema = self._bare(model, name, info)
        return schema | ({"description": text} if text else {})

    def _bare(self, model: type[Settings], name: str, info: FieldInfo) -> Schema:
        kinds = kinds_of(info)
        registry = registry_of(info)
        if kinds:
            place = registry.kind if registry is not None else f"{model.__name__}.{name}"
            table = self.of_kinds(place, kinds, may_be_own=registry is not None)
            is_list = str(info.annotation).startswith("tuple")
            return {"type": "array", "items": table} if is_list else _or_text(table)
        held = settings_of(info)
        if len(held) == 1 and (info.annotation is held[0]):
            return self.named(held[0].__name__, held[0], is_whole=False)
        validators = model.__pydantic_decorators__.field_validators.values()
        checked = {f for v in validators if v.info.mode != "after" for f in v.info.fields}
        if held or name in checked or any(isinstance(m, OPEN) for m in info.metadata):
            return {}
        annotation: Any = info.annotation
        try:
            own = TypeAdapter(annotation).json_schema()
        except Exception:  # of what pydantic knows no schema
            return {}
        return {} if "$defs" in own else own | _bounds(info)

    def named(self, name: str, model: type[Settings], *, is_whole: bool) -> Schema:
        """Return a reference to the schema of a model's table."""
        if name not in self.definitions:
            self.definitions[name] = {}  # it may hold itself
            self.definitions[name] = self.table(model, is_whole=is_whole)
        return {"$ref": f"#/$defs/{name}"}

    def of_kinds(
        self, place: str, kinds: Mapping[str, type[Settings]], *, may_be_own: bool
    ) -> Schema:
        """Return a reference to the schema of a table with keys that depend on its ``kind``."""
        if place not in self.definitions:
            self.definitions[place] = {}
            names: Schema = {"enum": list(kinds)}
            kind = {"anyOf": [names, {"type": "string"}]} if may_be_own else names
            branches = []
            union: dict[str, Schema] = {"kind": kind}
            for name, model in kinds.items():
                own = f"{place}.{name}"
                self.named(own, model, is_whole=False)
                self.definitions[own]["properties"]["kind"] = {
                    "const": name,
                    "description": " ".join((model.__doc__ or "").partition("\n\n")[0].split()),
                }
                is_it = {"properties": {"kind": {"const": name}}, "required": ["kind"]}
                branches.append({"if": is_it, "then": {"$ref": f"#/$defs/{own}"}})
                for key, schema in self.definitions[own]["properties"].items():
                    texts = {k: v for k, v in schema.items() if k == "description"}
                    union.setdefault(key, texts)
            self.definitions[place] = {"type": "object", "properties": union, "allOf": branches}
        return {"$ref": f"#/$defs/{place}"}


def _or_text(schema: Schema) -> Schema:
    """Return the schema of a table that may be written as the name of its kind."""
    return {"anyOf": [schema, {"type": "string"}]}


def _bounds(info: FieldInfo) -> Schema:
    """Return the bounds in the metadata of a field."""
    bounds: Schema = {}
    for mark in info.metadata:
        if isinstance(mark, Ge):
            bounds["minimum"] = mark.ge
        elif isinstance(mark, Gt):
            bounds["exclusiveMinimum"] = mark.gt
        elif isinstance(mark, Le):
            bounds["maximum"] = mark.le
        elif isinstance(mark, Lt):
            bounds["exclusiveMaximum"] = mark.lt
    return bounds


def schema(kind: str = "spec") -> Schema:
    """Return the JSON schema of specs, or of what one kind of table may hold.

    Parameters
    ----------
    kind
        ``spec``; a table, such as ``scenario``; or one kind of it: ``scenario.box-pushing``.

    Raises
    ------
    SpecError
        If there is no such kind.

    Examples
    --------
    >>> schema("scenario.line-up")["properties"]["carts"]["minimum"]
    1
    """
    expect("the name of a kind", str, kind=kind)
    writer = SchemaWriter()
    whole = _spec(writer)
    if kind == "spec":
        return {"$schema": DIALECT, "title": "A spec of nested-agents", **whole} | {
            "$defs": writer.definitions
        }
    if kind not in writer.definitions:
        is_one = "." in kind  # a kind of a table, as scenario.box-pushing
        names = ["spec", *(n for n in writer.definitions if n.islower() and ("." in n) <= is_one)]
        raise SpecError(f"schema {kind!r}: {closest(kind, names)}")
    own = writer.definitions[kind]
    return {"$schema": DIALECT, **own, "$defs": writer.definitions}


def _spec(writer: SchemaWriter) -> Schema:
    """Return the schema of a whole spec; the writer's definitions hold its tables."""
    layers = {
        name: writer.field(ConditionSettings, name, info)
        for name, info in ConditionSettings.model_fields.items()
    }

    def laid(model: type[Settings]) -> Schema:
        table = writer.table(model)
        for name in layers.keys() & table["properties"].keys():
            text = meaning(model, name)
            table["properties"][name] = layers[name] | {"description": text}
        return table

    whole = laid(Spec)
    known = whole["properties"]
    stage = laid(StageSettings)
    override = laid(Override)
    override["properties"]["curriculum"] = {"type": "array", "items": stage}
    override["properties"]["sweep"] = LISTS
    names: dict[str, Schema] = {
        "study": {"anyOf": [{"enum": STUDIES.names()}, {"type": "string"}]},
        "preset": {"anyOf": [{"enum": list(PRESETS)}, {"type": "string"}]},
        "seeds": {"anyOf": [{"type": "integer", "minimum": 1}, NUMBERS]},
        "sweep": LISTS,
        "tune": LISTS,
        "overrides": {"type": "array", "items": override},
        "curriculum": {"type": "array", "items": stage},
        "evaluations": {"type": "object", "additionalProperties": {"type": "object"}},
    }
    for name, own in names.items():
        known[name] = own | {"description": meaning(Spec, name)}
    return whole
