"""What is wrong with a spec, in one line a user can act on.

pydantic says where and what; this module turns that into the path as it stands in the spec, the
value found there, what is allowed, and the closest known name.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from ...core.plugins.settings import closest, dotted, mistaken, near, place, rule
from ..errors import show
from .overlay import Slot, field_of, kind_of, model_at, models_of, registry_of


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
        owner = _owner(keys[:-1], model, data)
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
        if isinstance(value, Mapping):
            path, value = f"{path}.kind", value.get("kind")
        return f"{path} = {show(value)}: {first['msg']}"
    if first["type"].startswith("union_tag"):
        path, value = f"{path}.kind", value.get("kind") if isinstance(value, Mapping) else value
        slot = _slot(keys, model, data)
        kinds = [kind_of(m) for m in models_of(getattr(slot, "annotation", slot))]
        return f"{path} = {show(value)}: {closest(value, [k for k in kinds if k])}"
    # The members of a union complain one by one about the same place: say what any would take.
    text = ", or ".join(dict.fromkeys(rule(e["msg"]) for there, e in problems if there == keys))
    owner = _owner(keys[:-1], model, data) if keys else None
    is_other_type = ("string" in text) is not isinstance(value, str)
    other = mistaken(keys[-1], owner.model_fields, first) if owner and is_other_type else ""
    return f"{path} = {show(value)}: {text}{other}"


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
    places = (name for name in _places(key, model, data) if not f".{path}".endswith(f".{name}"))
    matches = dict.fromkeys(places)
    return f"did you mean {' or '.join(map(repr, matches))}?" if matches and key != "kind" else ""


def _places(key: str, model: type[BaseModel], data: object, name: str = "") -> Iterator[str]:
    """Yield the dotted names that a key has in the tables below a model."""
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
                yield f"{name}{field}.{key}"
            yield from _places(key, inner, table, f"{name}{field}.")


def _slot(keys: Sequence[int | str], model: type[BaseModel], data: Any) -> Slot:
    """Return the model or field that the value at `keys` is for."""
    slot: Slot = model
    for key in keys:
        if isinstance(key, int):  # an item of a list is one of the models that the list may hold
            data = data[key]
            continue
        slot = field_of(model_at(slot, data), str(key))
        if slot is None:
            return None
        data = data[key]
    return slot


def _owner(
    keys: Sequence[int | str], model: type[BaseModel], data: Mapping[str, Any]
) -> type[BaseModel] | None:
    """Return the model of the table at `keys`."""
    inner: Any = data
    for key in keys:
        inner = inner[key]
    return model_at(_slot(keys, model, data), inner)
