"""What is wrong with something that the user can mend, in one line to act on."""

import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager

LONGEST = 1200
"""Characters of a message; of a longer one the middle is left out."""
WIDTH = 80
"""Of a line that is printed [characters]."""


class SpecError(ValueError):
    """Something the user can mend: its message is one line that names what, and what is allowed."""

    def __init__(self, message: str) -> None:
        line = " ".join(message.split())
        if len(line) > LONGEST:
            line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 4 :]}"
        super().__init__(printable(line))


def printable(text: str) -> str:
    r"""Return text in which what a terminal obeys is written out: nothing of it is an order.

    These are control characters, such as those of colours and of the cursor, but for line feeds and
    tabs; marks that reverse the direction of writing; and halves of surrogate pairs, which cannot
    be written.

    Examples
    --------
    >>> print(printable("plain, \x1b[31mred, \u202ereversed\r"))
    plain, \x1b[31mred, \u202ereversed\r
    """
    if text.isprintable():
        return text
    return "".join(map(_written_out, text))


def _written_out(character: str) -> str:
    if character.isprintable() or character in "\n\t" or unicodedata.category(character) == "Zs":
        return character
    return character.encode("unicode_escape").decode("ascii")


@contextmanager
def refused(before: str = "", after: str = "") -> Iterator[None]:
    """Raise each ValueError of the context as a `SpecError`, with text around its message."""
    try:
        yield
    except ValueError as error:
        raise SpecError(f"{before}{error}{after}") from None
