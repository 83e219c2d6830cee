"""What is wrong with a setting, in the words of the command line rather than pydantic's."""

from __future__ import annotations

import re


def rule(message: str) -> str:
    """Return what a value must be, for the message with which pydantic refuses it.

    Examples
    --------
    >>> rule("Input should be greater than or equal to 1")
    'must be at least 1'
    >>> rule("Input should be a valid integer, unable to parse string as an integer")
    'must be a whole number'
    """
    message = message.removeprefix("Value error, ").replace("Input should be", "must be")
    message = re.sub(r"a (valid )?dictionary( or .*)?$", "a table", message)
    message = re.sub(r"a (valid )?(tuple|list)$", "a list", message)
    message = re.sub(r"a valid integer.*$", "a whole number", message)
    return (
        message.replace("a valid ", "a ")
        .replace("less than or equal to", "at most")
        .replace("greater than or equal to", "at least")
    )
