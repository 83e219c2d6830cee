"""Answers of functions: an action, the content of a message, and costs.

An answer is the name or the index of an action, or a mapping of ``action``, ``message`` and
``costs``. The content of a message is any value that JSON can represent; its size is the number of
bytes of its JSON text.
"""

import json
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

KEYS = ("action", "message", "costs")
"""Keys of an answer that is a mapping."""


class Reply(NamedTuple):
    """Answer of an agent."""

    action: int
    """Index of the action."""
    message: object
    """Content of the message to other agents; None if there is none."""
    costs: Mapping[str, float]
    """Costs of the answer by name."""


def read_reply(answer: object, actions: Sequence[str], costs: Mapping[str, str]) -> Reply:
    """Return the answer of a function, checked.

    Parameters
    ----------
    answer
        Value that the function returned.
    actions
        Names of all actions.
    costs
        Units of the costs that the function may report, by name.

    Raises
    ------
    ValueError
        If the action is unknown, or the answer has other keys or values.

    Examples
    --------
    >>> read_reply("right", ("left", "right"), {})
    Reply(action=1, message=None, costs={})
    >>> read_reply({"action": 0, "message": "mine", "costs": {"tokens": 12}}, ["a"], {"tokens": ""})
    Reply(action=0, message='mine', costs={'tokens': 12.0})
    """
    if not isinstance(answer, Mapping):
        return Reply(_action(answer, actions), None, {})
    for key in answer:
        if key not in KEYS:
            raise ValueError(f"answers with {key!r}, allowed: {', '.join(KEYS)}")
    message = answer.get("message")
    content = None if message is None else json.loads(canonical(message))
    return Reply(_action(answer.get("action"), actions), content, _costs(answer, costs))


def _action(value: object, actions: Sequence[str]) -> int:
    if isinstance(value, str) and value in actions:
        return list(actions).index(value)
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        index = int(value)
        if 0 <= index < len(actions):
            return index
    raise ValueError(
        f"returns the action {value!r:.60}, allowed: {', '.join(actions)}, or 0 to "
        f"{len(actions) - 1}"
    )


def _costs(answer: Mapping[str, object], units: Mapping[str, str]) -> dict[str, float]:
    given = answer.get("costs") or {}
    if not isinstance(given, Mapping):
        raise ValueError(f"returns costs = {given!r:.60}, allowed: numbers by name")
    costs = {}
    for name, value in given.items():
        if name not in units:
            known = ", ".join(units) or "none"
            raise ValueError(
                f"returns costs.{name}: unknown cost, allowed: {known} (see learner.costs)"
            )
        is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if not is_number or not np.isfinite(value) or value < 0:
            raise ValueError(f"returns costs.{name} = {value!r:.60}, allowed: numbers from 0")
        costs[str(name)] = float(value)
    return costs


def canonical(value: object) -> str:
    """Return the unique compact JSON text of a value.

    Raises
    ------
    ValueError
        If JSON cannot represent the value.
    """
    try:
        return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(
            f"{value!r:.60}: {error}; allowed: values that JSON can represent"
        ) from None
