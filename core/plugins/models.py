"""Settings models of the tables of a spec, found by the fields of models and the kinds of tables.

A *slot* takes a table: it is a model, or a field of a model that may hold one of several models.
"""

from __future__ import annotations

import typing
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Slot = type[BaseModel] | FieldInfo | None
"""Model or field that takes a table; None if it is unknown."""


class Kinds(ABC):
    """Mark of a field that holds settings of one of several kinds."""

    @abstractmethod
    def model(self, kind: str) -> type[BaseModel]:
        """Return the settings model of a kind.

        Raises
        ------
        ValueError
            If there is none; one line.
        """

    @abstractmethod
    def built_in(self) -> Iterable[str]:
        """Return the kinds that are built in."""


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


def kinds_at(slot: Slot) -> Kinds | None:
    """Return the kinds with which a field is marked, or None."""
    marks = slot.metadata if isinstance(slot, FieldInfo) else []
    return next((mark for mark in marks if isinstance(mark, Kinds)), None)


def model_at(slot: Slot, table: object) -> type[BaseModel] | None:
    """Return the model of a table; None if its kind is unknown or missing."""
    kind = table.get("kind") if isinstance(table, Mapping) else None
    if kind is None and isinstance(slot, FieldInfo) and not slot.is_required():
        default = slot.get_default(call_default_factory=True)
        if isinstance(default, BaseModel):
            return type(default)
    kinds = kinds_at(slot)
    if kinds is not None:
        try:
            return kinds.model(str(kind))
        except ValueError:
            return None
    models = models_of(annotation_of(slot))
    if len(models) == 1:
        return models[0]
    return next((m for m in models if kind is not None and kind_of(m) == kind), None)


def field_of(model: type[BaseModel] | None, key: str) -> FieldInfo | None:
    """Return the field of a model for a key of its table."""
    return None if model is None else model.model_fields.get(key)
