"""What a function answers: an action, and what it says beside and has cost.

An answer is the name or the index of an action, or a table of ``action``, ``message`` and
``costs``. What is said, the *content* of a message, is whatever JSON holds; its size is the number
of bytes of its JSON text.
"""

import json
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .recorded import canonical

KEYS = ("action", "message", "costs")
"""What a table may hold."""


class Reply(NamedTuple):
    """What an agent has decided, said and spent."""

    action: int
    """Index of its action."""
    message: object
    """What it says to others; none: nothing."""
    costs: Mapping[str, float]
    """What the answer has cost, by name."""


def read_reply(answer: object, actions: Sequence[str], costs: Mapping[str, str]) -> Reply:
    """Return what a function's answer means.

    Parameters
    ----------
    answer
        What it has returned.
    actions
        Names of all actions.
    costs
        Units of what it may say to have spent, by name.

    Raises
    ------
    ValueError
        If there is no such action, or the answer holds something else; one line.

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
            raise ValueError(f"returns costs.{name}, learner.costs names {known}")
        is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if not is_number or not np.isfinite(value) or value < 0:
            raise ValueError(f"returns costs.{name} = {value!r:.60}, allowed: numbers from 0")
        costs[str(name)] = float(value)
    return costs
