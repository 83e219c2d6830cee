"""Messages about mistakes in settings: one line that a user can act on.

Each names the path in the spec, the value, what is allowed and the closest known name, from the
errors of pydantic.
"""

from __future__ import annotations

import re
import typing
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from .models import Slot, annotation_of, field_of, kind_of, kinds_at, model_at, models_of
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


class Complaint(NamedTuple):
    """One error of pydantic."""

    keys: Keys
    """Path in the table."""
    details: ErrorDetails
    """The error as pydantic reports it."""

    @property
    def path(self) -> str:
        """The path as text."""
        return dotted(self.keys)


def problems_of(error: ValidationError, table: Table) -> list[Complaint]:
    """Return the errors of pydantic about a table."""
    return [Complaint(place(e["loc"], table), e) for e in error.errors(include_url=False)]


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
    problems = problems_of(error, table)
    # Where a name or a table may stand and a table does, what is wrong is in the table.
    start = problems[0].keys
    inside = [p for p in problems if len(p.keys) > len(start) and p.keys[: len(start)] == start]
    problem = (inside or problems)[0]
    kind_of_problem = problem.details["type"]
    if kind_of_problem == "extra_forbidden":
        return _on_unknown_key(problem, model, table, outer or (model, table))
    if kind_of_problem == "missing":
        name = problem.details["loc"][-1]
        is_there = problem.keys[-1:] == (name,) or isinstance(name, int)
        return f"{problem.path if is_there else dotted((*problem.keys, name))}: missing"
    if kind_of_problem == "plugged_kind":
        kind = entry(problem.details["input"], "kind")
        hint = several((*problem.keys, "kind"), kind, "", swept_in)
        return f"{_on_kind(problem)}{problem.details['msg']}{hint}"
    if kind_of_problem.startswith("union_tag"):
        return _on_unknown_kind(problem, model, table)
    # The members of a union complain one by one about the same place: say what any would take.
    same = [p for p in problems if p.keys == problem.keys]
    text = ", or ".join(dict.fromkeys(rule(p.details["msg"]) for p in same))
    return _on_value(problem, text, model, table, swept_in)


def _on_unknown_key(
    problem: Complaint,
    model: type[BaseModel],
    table: Table,
    outer: tuple[type[BaseModel], Table],
) -> str:
    key = problem.keys[-1]
    owner = model_at(*_reach(problem.keys[:-1], model, table))
    kind = kind_of(owner) if owner is not None else None
    known = set() if owner is None else set(owner.model_fields)
    misspelt = near(key, known, cutoff=0.85)
    hint = misspelt or misplaced(problem.path, *outer) or closest(key, known)
    of_kind = f" for kind {kind!r}" if kind else ""
    return f"{problem.path} = {show(problem.details['input'])}: unknown key{of_kind}; {hint}"


def _on_kind(problem: Complaint) -> str:
    """Return the beginning of a line about the kind of a table."""
    value = problem.details["input"]
    if isinstance(value, Mapping) and "kind" in value:
        return f"{problem.path}.kind = {show(value['kind'])}: "
    return f"{problem.path} = {show(value)}: " + "kind is missing; " * isinstance(value, Mapping)


def _on_unknown_kind(problem: Complaint, model: type[BaseModel], table: Table) -> str:
    slot, _ = _reach(problem.keys, model, table)
    kinds = map(kind_of, models_of(annotation_of(slot)))
    kind = problem.details["input"].get("kind")
    hint = closest(kind, [known for known in kinds if known])
    return f"{_on_kind(problem)}{hint}{_pointer(problem.keys, kind, model, table)}"


def _on_value(
    problem: Complaint, text: str, model: type[BaseModel], table: Table, swept_in: str
) -> str:
    if not problem.keys:
        return text
    value = problem.details["input"]
    owner = model_at(*_reach(problem.keys[:-1], model, table))
    is_other_type = ("string" in text) is not isinstance(value, str)
    hint = ""
    if owner is not None and is_other_type:
        hint = mistaken(problem.keys[-1], owner.model_fields, problem.details["type"])
    hint = hint or _pointer(problem.keys, value, model, table)
    hint = hint or several(problem.keys, value, text, swept_in)
    return f"{problem.path} = {show(value)}: {text}{hint}"


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
    kinds = kinds_at(field)
    if kinds is None:
        return models_of(field.annotation)
    return [kinds.model(kind) for kind in kinds.built_in()]


def _reach(keys: Keys, model: type[BaseModel], table: Table) -> tuple[Slot, object]:
    """Return the model or field that the value at `keys` is for, and the value."""
    slot: Slot = model
    value: object = table
    for key in keys:
        if isinstance(key, str):  # an item of a list is one of the models that the list may hold
            slot = field_of(model_at(slot, value), key)
        value = entry(value, key)
    return slot, value
