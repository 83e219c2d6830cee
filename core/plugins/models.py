"""Settings models of the tables of a spec, found by the fields of models and the kinds of tables.

A *slot* takes a table: it is a model, or a field of a model that may hold one of several models.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from typing import Any

from pydantic import (
    BaseModel,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializationInfo,
    ValidationInfo,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

Slot = type[BaseModel] | FieldInfo | None
"""Model or field that takes a table; None if it is unknown."""


_described: ContextVar[tuple[str, ...]] = ContextVar("registries", default=())
"""Registries with a JSON schema that is being written."""


class Plugged:
    """Mark of a field that holds the settings of any thing of a registry.

    A table is validated by the model of its ``kind``, text is converted by `shorthand`, and
    settings are kept.

    Parameters
    ----------
    registry
        The registry, see `registry.SettingsRegistry`.
    shorthand
        Converts text to settings. By default, a table is required.
    """

    def __init__(self, registry: Any, shorthand: Callable[[str], BaseModel] | None = None) -> None:
        self.registry = registry
        self.shorthand = shorthand

    def model(self, kind: str) -> type[BaseModel]:
        """Return the settings model of a kind.

        Raises
        ------
        ValueError
            If there is none; one line.
        """
        model: type[BaseModel] = self.registry.model(kind)
        return model

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Return the pydantic schema of the field."""
        return core_schema.with_info_plain_validator_function(
            self._validate,
            serialization=core_schema.plain_serializer_function_ser_schema(_dump, info_arg=True),
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Return the JSON schema: a table of a built-in kind, any other table, or a text."""
        names = list(self.registry.built_in)
        other = {"type": "object", "properties": {"kind": {"not": {"enum": names}}}}
        tables: list[JsonSchemaValue] = [other, {"type": "string"}]
        title = self.registry.kind
        if title not in _described.get():  # a team inside a team is not described again
            token = _described.set((*_described.get(), title))
            for name in reversed(names):
                model = self.model(name)
                model.model_rebuild()
                tables.insert(0, handler(model.__pydantic_core_schema__))
            _described.reset(token)
        return {"title": title, "anyOf": tables}

    def _validate(self, value: object, info: ValidationInfo) -> BaseModel:
        if isinstance(value, BaseModel):
            return value
        if isinstance(value, str) and self.shorthand is not None:
            return self.shorthand(value)
        if not isinstance(value, Mapping):
            words = "a name or a table" if self.shorthand is not None else "a table"
            raise PydanticCustomError("table", f"must be {words}")
        try:
            model = self.model(str(value.get("kind", "")))
        except ValueError as error:
            raise PydanticCustomError(
                "plugged_kind", "{message}", {"message": str(error)}
            ) from None
        return model.model_validate(tuples(value), strict=True, context=info.context)


def _dump(value: BaseModel, info: SerializationInfo) -> dict[str, object]:
    """Dump settings like the model that holds them."""
    return value.model_dump(mode=info.mode, exclude_none=info.exclude_none)


def tuples(value: Any) -> Any:
    """Return `value` with tuples instead of lists, as strict validation requires."""
    if isinstance(value, Mapping):
        return {key: tuples(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return tuple(tuples(inner) for inner in value)
    return value


def annotation_of(slot: Slot) -> object:
    """Return the type of the value in a slot."""
    return slot.annotation if isinstance(slot, FieldInfo) else slot


def models_of(annotation: object) -> list[type[BaseModel]]:
    """Return the settings models that a field's annotation allows, in order."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in typing.get_args(annotation) for model in models_of(part)]


def kind_of(model: type[BaseModel]) -> str | None:
    """Return the `kind` of a model, or None."""
    field = model.model_fields.get("kind")
    return None if field is None else field.default or None


def plug_at(slot: Slot) -> Plugged | None:
    """Return the mark of a field for things of a registry, or None."""
    marks = slot.metadata if isinstance(slot, FieldInfo) else []
    return next((mark for mark in marks if isinstance(mark, Plugged)), None)


def model_at(slot: Slot, table: object) -> type[BaseModel] | None:
    """Return the model of a table; None if its kind is unknown or missing."""
    kind = table.get("kind") if isinstance(table, Mapping) else None
    if kind is None and isinstance(slot, FieldInfo) and not slot.is_required():
        default = slot.get_default(call_default_factory=True)
        if isinstance(default, BaseModel):
            return type(default)
    plug = plug_at(slot)
    if plug is not None:
        try:
            return plug.model(str(kind))
        except ValueError:
            return None
    models = models_of(annotation_of(slot))
    if len(models) == 1:
        return models[0]
    return next((m for m in models if kind is not None and kind_of(m) == kind), None)


def field_of(model: type[BaseModel] | None, key: str) -> FieldInfo | None:
    """Return the field of a model for a key of its table."""
    return None if model is None else model.model_fields.get(key)
