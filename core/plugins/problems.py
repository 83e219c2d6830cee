"""Messages about mistakes in settings: one line that a user can act on.

Each names the path in the spec, the value, what is allowed and the closest known name, from the
errors of pydantic.
"""

from __future__ import annotations

import re
import typing
from collections.abc import Collection, Iterator, Mapping, Sequence

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from .models import Slot, annotation_of, field_of, kind_of, model_at, models_of, plug_at
from .words import closest, near, shallowest, show

Keys = tuple[int | str, ...]
"""Path of a value: keys of tables and indices of lists."""
Table = Mapping[str, object]
"""Nested dictionary as TOML reads it."""


def dotted(keys: Keys) -> str:
    """Return a path as text, such as ``overrides[1].learner.ridge``."""
    path = ""
    for key in keys:
        path += f"[{key}]" if isinstance(key, int) else f".{key}"
    return path.lstrip(".").replace("\n", " ")


def rule(message: str) -> str:
    """Rewrite a message of pydantic as a requirement.

    Examples
    --------
    >>> rule("Input should be greater than or equal to 1")
    'must be at least 1'
    >>> rule("Input should be a valid integer, unable to parse string as an integer")
    'must be a whole number'
    >>> rule("Tuple should have at most 8 items after validation, not 9")
    'must have at most 8 items, not 9'
    """
    message = message.removeprefix("Value error, ").replace("Input should be", "must be")
    message = re.sub(r"a (valid )?dictionary( or .*)?$", "a table", message)
    message = re.sub(r"a (valid )?(tuple|list)$", "a list", message)
    message = re.sub(r"a valid integer.*$", "a whole number", message)
    message = re.sub(r"^\w+ should have (.*) after validation", r"must have \1", message)
    return (
        message.replace("a valid ", "a ")
        .replace("Field required", "must have all keys that it needs")
        .replace("less than or equal to", "at most")
        .replace("greater than or equal to", "at least")
    )


def mistaken(key: object, known: Collection[str], problem: str) -> str:
    """Return "; did you mean ...?" if a key that refuses its value is nearly another one's name.

    An out-of-range value (`problem`) belongs to the right key and gets no hint.

    Examples
    --------
    >>> mistaken("robot", ["robot", "robots", "box"], "string_type")
    "; did you mean 'robots'?"
    >>> mistaken("robots", ["robot", "robots"], "less_than_equal")
    ''
    """
    if "_than" in problem or problem == "value_error":
        return ""
    hint = near(key, set(known) - {str(key)}, cutoff=0.85)
    return f"; {hint}" if hint else ""


def place(loc: Sequence[int | str], data: object) -> Keys:
    """Return a path of pydantic without parts that name members of unions."""
    keys: list[int | str] = []
    for index, item in enumerate(loc):
        is_table = isinstance(data, Mapping)
        if has_entry(data, item):
            keys.append(item)
            data = entry(data, item)
        elif index == len(loc) - 1 and is_table and not keys:
            keys.append(item)
    return tuple(keys)


def has_entry(data: object, key: int | str) -> bool:
    """Return whether a table has a key, or a list an index."""
    if isinstance(data, Mapping):
        return key in data
    is_list = isinstance(data, Sequence) and not isinstance(data, str)
    return is_list and isinstance(key, int) and key < len(typing.cast(Sequence[object], data))


def entry(data: object, key: int | str) -> object:
    """Return the entry of a table at a key, or of a list at an index; None if there is none."""
    if isinstance(data, Mapping):
        return data.get(key)
    return data[key] if isinstance(data, Sequence) and isinstance(key, int) else None


def explain(
    error: ValidationError,
    model: type[BaseModel],
    table: Table,
    outer: tuple[type[BaseModel], Table] | None = None,
    swept_in: str = "",
) -> str:
    """Return one line on the first thing that pydantic found wrong with a table.

    Parameters
    ----------
    error
        Error of pydantic.
    model
        The model of the table.
    table
        The table of the user.
    outer
        Model and table to which a misplaced key may belong. By default, `model` and `table`.
    swept_in
        Name of the table of swept values; empty if there is none.
    """
    problems = [(place(e["loc"], table), e) for e in error.errors(include_url=False)]
    # Where a name or a table may stand and a table does, what is wrong is in the table.
    start, _ = problems[0]
    inside = [p for p in problems if len(p[0]) > len(start) and p[0][: len(start)] == start]
    keys, details = (inside or problems)[0]
    path = dotted(keys)
    value = details["input"]
    kind = entry(value, "kind")
    if details["type"] == "missing":
        name = details["loc"][-1]
        is_there = keys[-1:] == (name,) or isinstance(name, int)
        return f"{path if is_there else dotted((*keys, name))}: missing"
    if details["type"] == "plugged_kind":
        hint = several((*keys, "kind"), kind, "", swept_in)
        return f"{_on_kind(path, value)}{details['msg']}{hint}"
    if details["type"].startswith("union_tag"):
        slot, _ = _reach(keys, model, table)
        kinds = map(kind_of, models_of(annotation_of(slot)))
        hint = closest(kind, [known for known in kinds if known])
        return f"{_on_kind(path, value)}{hint}{_pointer(keys, kind, model, table)}"
    # The members of a union complain one by one about the same place: say what any would take.
    same = [details["msg"] for own, details in problems if own == keys]
    text = ", or ".join(dict.fromkeys(map(rule, same)))
    if not keys:
        return text
    owner = model_at(*_reach(keys[:-1], model, table))
    if details["type"] == "extra_forbidden":
        return f"{path} = {show(value)}: {_on_unknown_key(keys, owner, outer or (model, table))}"
    is_other_type = ("string" in text) is not isinstance(value, str)
    hint = ""
    if owner is not None and is_other_type:
        hint = mistaken(keys[-1], owner.model_fields, details["type"])
    hint = hint or _pointer(keys, value, model, table) or several(keys, value, text, swept_in)
    return f"{path} = {show(value)}: {text}{hint}"


def _on_unknown_key(
    keys: Keys, owner: type[BaseModel] | None, outer: tuple[type[BaseModel], Table]
) -> str:
    known = set() if owner is None else set(owner.model_fields)
    kind = kind_of(owner) if owner is not None else None
    misspelt = near(keys[-1], known, cutoff=0.85)
    hint = misspelt or misplaced(dotted(keys), *outer) or closest(keys[-1], known)
    of_kind = f" for kind {kind!r}" if kind else ""
    return f"unknown key{of_kind}; {hint}"


def _on_kind(path: str, value: object) -> str:
    """Return the beginning of a line about the kind of a table."""
    if isinstance(value, Mapping) and "kind" in value:
        return f"{path}.kind = {show(value['kind'])}: "
    return f"{path} = {show(value)}: " + "kind is missing; " * isinstance(value, Mapping)


def several(keys: Keys, value: object, text: str, swept_in: str) -> str:
    """Return a hint at the table of swept values if a list was given for one value.

    Examples
    --------
    >>> several(("scenario", "robots"), [2, 4], "must be a whole number", "sweep")
    '; put values to compare in sweep'
    """
    is_one = isinstance(value, list | tuple) and len(keys) > 1 and isinstance(keys[-1], str)
    is_meant = swept_in and is_one and "list" not in text
    return f"; put values to compare in {swept_in}" if is_meant else ""


def _pointer(keys: Keys, value: object, model: type[BaseModel], table: Table) -> str:
    """Return "; did you mean ...?" if a key of the same name in another table takes a word."""
    places = _places(str(keys[-1]), model, table) if keys and isinstance(value, str) else ()
    match = next((n for n, field in places if value in typing.get_args(field.annotation)), None)
    return f"; did you mean {match} = {value!r}?" if match and match != dotted(keys) else ""


def misplaced(path: str, model: type[BaseModel], table: Table) -> str:
    """Return "did you mean ...?" if the last part of a dotted key is a key of some other table.

    Of several tables, those that lie least deep are named.

    Parameters
    ----------
    path
        The key as it stands in the spec.
    model
        Model with the tables to search, at any depth.
    table
        The table of the user: where it has a kind, other kinds are not searched.
    """
    key = path.rpartition(".")[2]
    names = (name for name, _ in _places(key, model, table))
    matches = shallowest(name for name in names if not f".{path}".endswith(f".{name}"))
    return f"did you mean {' or '.join(map(repr, matches))}?" if matches and key != "kind" else ""


def _places(
    key: str,
    model: type[BaseModel],
    table: object,
    name: str = "",
    above: tuple[type[BaseModel], ...] = (),
) -> Iterator[tuple[str, FieldInfo]]:
    """Yield the dotted name and the field of every occurrence of a key below a model.

    A model that can contain itself is searched once.
    """
    for field, info in model.model_fields.items():
        own = table.get(field) if isinstance(table, Mapping) else None
        for held in _held(info, own):
            if held in above:
                continue
            if key in held.model_fields:
                yield f"{name}{field}.{key}", held.model_fields[key]
            yield from _places(key, held, own, f"{name}{field}.", (*above, held))


def _held(field: FieldInfo, table: object) -> Sequence[type[BaseModel]]:
    """Return the models that a field's table may have: one if the kind is known, else all."""
    own = model_at(field, table)
    if own is not None:
        return [own]
    plug = plug_at(field)
    if plug is None:
        return models_of(field.annotation)
    return [plug.model(kind) for kind in plug.registry.built_in]


def _reach(keys: Keys, model: type[BaseModel], table: Table) -> tuple[Slot, object]:
    """Return the model or field that the value at `keys` is for, and the value."""
    slot: Slot = model
    value: object = table
    for key in keys:
        if isinstance(key, str):  # an item of a list is one of the models that the list may hold
            slot = field_of(model_at(slot, value), key)
        value = entry(value, key)
    return slot, value
