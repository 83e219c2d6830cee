"""Errors of the user, reported in one line."""

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
