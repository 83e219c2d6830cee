"""Escaping of control characters in text from files, so that a terminal does not obey them."""

import unicodedata


def printable(text: str) -> str:
    r"""Return text in which control characters are escaped.

    These are control characters except line feeds and tabs, such as those of colors and of the
    cursor; marks that reverse the direction of writing; and halves of surrogate pairs.

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
