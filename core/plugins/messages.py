"""What is wrong with a setting, in the words of the command line rather than pydantic's."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError

Keys = tuple[int | str, ...]
"""Where a value stands: keys of tables, and indices of lists."""


def near(name: object, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return "did you mean ...?" if a known name is near, else nothing.

    Examples
    --------
    >>> near("chian", ["chain", "tree"]), near("ring", ["chain", "tree"])
    ("did you mean 'chain'?", '')
    """
    matches = difflib.get_close_matches(str(name), list(known), n=1, cutoff=cutoff)
    return f"did you mean {matches[0]!r}?" if matches else ""


def closest(name: object, known: Iterable[str]) -> str:
    """Return "did you mean ...?" if a known name is near, and the known names in any case.

    Examples
    --------
    >>> closest("chian", ["chain", "tree"])
    "did you mean 'chain'? known: chain, tree"
    """
    known = sorted(known)
    return f"{near(name, known)} known: {', '.join(known) or 'none'}".lstrip()


def mistaken(key: object, known: Collection[str], problem: Mapping[str, Any]) -> str:
    """Return "; did you mean ...?" if a key that refuses its value is nearly another one's name.

    A value that is only out of range, by the `problem` that was found, is of the right key.

    Examples
    --------
    >>> mistaken("robot", ["robot", "robots", "box"], {"type": "string_type"})
    "; did you mean 'robots'?"
    >>> mistaken("robots", ["robot", "robots"], {"type": "less_than_equal"})
    ''
    """
    of_key = "_than" in problem["type"] or problem["type"] == "value_error"
    others = () if of_key else set(known) - {str(key)}
    hint = near(key, others, cutoff=0.85)
    return f"; {hint}" if hint else ""


def rule(message: str) -> str:
    """Return what a value must be, for the message with which pydantic refuses it.

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


def one_line(error: ValidationError, data: Mapping[str, object], known: Collection[str]) -> str:
    """Return one line on the first thing that pydantic found wrong.

    Parameters
    ----------
    error
        What pydantic raised.
    data
        The table that it validated.
    known
        The keys that the table may have.
    """
    problems = [(place(e["loc"], data), e) for e in error.errors(include_url=False)]
    keys, first = problems[0]
    path = dotted(keys)
    if first["type"] == "missing":
        return f"{path}: missing" if keys else f"{first['loc'][-1]}: missing"
    if first["type"] == "extra_forbidden":
        top = closest(keys[-1], known) if len(keys) == 1 else ""
        return f"{path} = {first['input']!r}: unknown key; {top}".removesuffix("; ")
    # The members of a union complain one by one about the same place: say what any would take.
    rules = dict.fromkeys(rule(e["msg"]) for keys_, e in problems if keys_ == keys)
    message = ", or ".join(rules) + (mistaken(keys[0], known, first) if len(keys) == 1 else "")
    return f"{path} = {first['input']!r}: {message}" if keys else message


def place(loc: Sequence[int | str], data: object) -> Keys:
    """Drop from pydantic's path what names a member of a union rather than a key of the table."""
    keys: list[int | str] = []
    for index, item in enumerate(loc):
        inside = isinstance(data, Mapping) and item in data
        listed = isinstance(data, Sequence) and isinstance(item, int) and item < len(data)
        if inside or (listed and not isinstance(data, str)):
            keys.append(item)
            data = data[item]  # type: ignore[index]
        elif index == len(loc) - 1 and isinstance(data, Mapping) and not keys:
            keys.append(item)
    return tuple(keys)


def dotted(keys: Keys) -> str:
    """Return where a value stands as it is written: ``overrides[1].learner.ridge``."""
    path = ""
    for key in keys:
        path += f"[{key}]" if isinstance(key, int) else f".{key}"
    return path.lstrip(".").replace("\n", " ")
