"""Errors of the user, reported in one line."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..core.plugins.printing import printable

LONGEST = 1200
"""Characters of a message; of a longer one the middle is left out."""
WIDTH = 80
"""Maximum length of a printed line [characters]."""


class SpecError(ValueError):
    """Mistake of the user: one line that names the key, its value and what is allowed."""

    def __init__(self, message: str) -> None:
        line = " ".join(message.split())
        if len(line) > LONGEST:
            line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 4 :]}"
        super().__init__(printable(line))


@contextmanager
def refused(before: str = "", after: str = "") -> Iterator[None]:
    """Raise each ValueError of the context as a `SpecError`, with text around its message."""
    try:
        yield
    except ValueError as error:
        raise SpecError(f"{before}{error}{after}") from None


def exception_line(error: str) -> str:
    r"""Return the line that says what went wrong: the first one after the stack of a traceback.

    >>> exception_line("Traceback:\n  File f\nValueError: no path\nfrom 0 to 3\n")
    'ValueError: no path'
    """
    last = re.split(r"^Traceback.*\n", error, flags=re.MULTILINE)[-1]
    lines = last.split("\n")
    return next((line for line in lines if line and not line[0].isspace()), last.strip())
