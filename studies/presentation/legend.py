"""Explanations of table columns."""

import tomllib
from collections.abc import Iterable
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path


@cache
def _known() -> dict[str, str]:
    """Return meanings by title, without its unit; an asterisk is any name."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def meanings(titles: Iterable[str]) -> dict[str, str]:
    """Return explanations of columns by title, as far as they are known.

    Examples
    --------
    >>> meanings(["decision time [ms]", "humidity"])
    {'decision time [ms]': 'median time of a decision of the whole team'}
    """
    names = {title: title.partition(" [")[0] for title in titles}
    matches = {
        title: [text for pattern, text in _known().items() if fnmatchcase(name, pattern)]
        for title, name in names.items()
    }
    return {title: texts[0] for title, texts in matches.items() if texts}
