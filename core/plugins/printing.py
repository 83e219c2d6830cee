"""Text of others, written so that a terminal obeys nothing of it."""

import unicodedata
from pathlib import Path
from shlex import quote


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


def shell_word(path: Path) -> str:
    """Return a path as typed in a shell, where it is never taken for an option.

    Examples
    --------
    >>> shell_word(Path("out/mine")), shell_word(Path("-dash")), shell_word(Path("my out"))
    ('out/mine', './-dash', "'my out'")
    """
    text = str(path)
    return quote(f"./{text}" if text.startswith("-") else text)
