"""Text of others, written so that a terminal obeys nothing of it."""

import unicodedata


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
