"""Fonts for any script: missing characters come from other installed fonts."""

from __future__ import annotations

import warnings
from functools import cache

from matplotlib import font_manager
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text


def cover_text(figure: Figure) -> None:
    """Add font families to the texts of a figure until all of their characters can be drawn.

    Characters that no installed font has are named in a warning. They are boxes in PNG and PDF
    files; SVG files keep them as text.
    """
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    texts = [text for text in texts if not text.get_text().isascii()]
    lacking = "".join(dict.fromkeys(c for text in texts for c in _lacking(text)))
    if not lacking:
        return
    families, left = _covering(lacking)
    for text in texts:
        own = text.get_fontfamily()
        text.set_fontfamily([*own, *(name for name in families if name not in own)])
    if left:
        warnings.warn(
            f"no installed font has {left}: boxes stand for these characters in PNG and PDF "
            "figures; install one that does, such as Noto Sans CJK for Chinese",
            stacklevel=2,
        )


def _lacking(text: Text) -> list[str]:
    """Return the characters of a text that its own fonts lack."""
    families = text.get_fontfamily()
    has = [
        font_manager.get_font(font_manager.findfont(FontProperties(family=[family]))).get_char_index
        for family in families
    ]
    return [c for c in text.get_text() if c.isprintable() and not any(h(ord(c)) for h in has)]


@cache
def _covering(characters: str) -> tuple[tuple[str, ...], str]:
    """Return families of installed fonts that have characters, and the characters left over.

    Each next font covers the most of the remaining characters.
    """
    coverage: dict[str, frozenset[str]] = {}
    for path in sorted(font_manager.findSystemFonts()):
        try:
            index = font_manager.get_font(path).get_char_index
        except (OSError, RuntimeError):  # bitmaps, or damaged
            continue
        coverage[path] = frozenset(c for c in characters if index(ord(c)))
    families: list[str] = []
    left = set(characters)
    while coverage and (best := max(coverage, key=lambda p: len(coverage[p] & left))):
        if not coverage[best] & left:
            break
        left -= coverage[best]
        font_manager.fontManager.addfont(best)
        families.append(font_manager.get_font(best).family_name)
    return tuple(families), "".join(c for c in characters if c in left)
