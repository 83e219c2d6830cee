"""JSON schema of specs, with which editors complete and check them.

pydantic derives it from the models that validate specs. Tables of a spec override a preset, so that
no key of them is required.
"""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema, models_json_schema
from pydantic_core import core_schema

from .conditions import ConditionSettings, Override, StageSettings
from .docstrings import field_docstring
from .presets import PRESETS
from .spec import Spec
from .studies import STUDIES

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"
REGISTRIES = ("scenario", "topology", "learner", "exploration", "evaluator")
"""Registries of tables with kinds."""
LISTS: Schema = {"$ref": "#/$defs/lists"}
"""Lists of values by dotted key, or by table."""


class KeySchema(GenerateJsonSchema):
    """Generator of the schema of settings, with the docstrings of their fields."""

    def model_schema(self, schema: core_schema.ModelSchema) -> Schema:
        """Return the schema of a settings model, with the docstrings of its fields."""
        table = super().model_schema(schema)
        for name, key in table.get("properties", {}).items():
            if text := field_docstring(schema["cls"], name):
                key["description"] = text
        return table

    def tagged_union_schema(self, schema: core_schema.TaggedUnionSchema) -> Schema:
        """Return the schema of tables of several kinds; the kind may be left out."""
        union = super().tagged_union_schema(schema)
        return {"anyOf": union["oneOf"]}


def schema() -> Schema:
    """Return the JSON schema of specs.

    Examples
    --------
    >>> schema()["properties"]["episodes"]["minimum"]
    1
    """
    models = (Spec, Override, StageSettings, ConditionSettings)
    _, whole = models_json_schema(
        [(model, "validation") for model in models], schema_generator=KeySchema
    )
    definitions = whole["$defs"]
    sections = definitions.pop("ConditionSettings")["properties"]
    for name in ("Spec", "Override", "StageSettings"):
        keys = definitions[name]["properties"]
        for section in sections.keys() & keys.keys():
            keys[section] = sections[section] | {"description": keys[section]["description"]}
    lists = {"anyOf": [{"type": "array"}, LISTS]}
    definitions["lists"] = {"type": "object", "additionalProperties": lists}
    spec = definitions.pop("Spec")
    names: Schema = {
        "study": {"anyOf": [{"enum": STUDIES.names()}, {"type": "string"}]},
        "preset": {"anyOf": [{"enum": list(PRESETS)}, {"type": "string"}]},
        "sweep": LISTS,
        "tune": LISTS,
        "evaluations": {"type": "object", "additionalProperties": {"type": "object"}},
    }
    for name, own in names.items():
        spec["properties"][name] = own | {"description": field_docstring(Spec, name)}
    definitions["Override"]["properties"]["sweep"] = LISTS
    shared: Schema = {}
    spec, definitions = (_share(part, shared) for part in (spec, definitions))
    definitions["Override"]["required"] = ["name"]
    definitions["StageSettings"]["required"] = ["name", "episodes"]
    title = "A spec of nested-agents"
    return {"$schema": DIALECT, "title": title, **spec, "$defs": definitions | shared}


def _share(part: Any, shared: Schema) -> Any:
    """Return a part of a schema with references to the tables of registries.

    Each table is added to `shared` under the name of its registry. Other titles are left out, and
    required keys, because a preset may have them.
    """
    if isinstance(part, list):
        return [_share(item, shared) for item in part]
    if not isinstance(part, dict):
        return part
    plain = {
        key: _share(value, shared)
        for key, value in part.items()
        if key not in ("title", "required") or isinstance(value, dict)
    }
    name = part.get("title")
    if name not in REGISTRIES or "anyOf" not in plain:
        return plain
    shared.setdefault(name, {"anyOf": plain.pop("anyOf")})
    return plain | {"$ref": f"#/$defs/{name}"}
