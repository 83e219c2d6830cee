"""Fonts of scripts that the usual font lacks."""

from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.text import Text

FALLBACKS = (
    "Noto Sans CJK SC",
    "Noto Sans CJK JP",
    "Noto Sans CJK KR",
    "Noto Sans Devanagari",
    "Noto Sans Thai",
    "Droid Sans Fallback",
    "WenQuanYi Zen Hei",
    "Arial Unicode MS",
    "Microsoft YaHei",
    "PingFang SC",
)
"""Families that are tried, in this order, for characters that the font of a text lacks."""


def cover_text(figure: Figure) -> None:
    """Add installed fallback fonts to the texts of a figure that are not ASCII.

    matplotlib warns of characters that no font has and draws boxes for them in PNG and PDF files.
    """
    installed = {font.name for font in fontManager.ttflist}
    families = [name for name in FALLBACKS if name in installed]
    for text in figure.findobj(Text):
        if isinstance(text, Text) and not text.get_text().isascii():
            own = [name for name in text.get_fontfamily() if name not in families]
            text.set_fontfamily([*own, *families])
