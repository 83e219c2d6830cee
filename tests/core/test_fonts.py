"""Texts of figures in scripts that the usual font lacks."""

import warnings
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import font_manager
from matplotlib.figure import Figure

from nested_agents.core import fonts

FONTS = Path(mpl.get_data_path()) / "fonts" / "ttf"
PLAIN = str(FONTS / "DejaVuSans.ttf")
OTHER = str(FONTS / "STIXGeneral.ttf")
HAS = "\u1d8a"  # a phonetic letter that STIX has and DejaVu Sans has not
HAS_NOT = "\u6c49\u5b57"


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Nothing is known of the installed fonts."""
    fonts._covering.cache_clear()
    yield
    fonts._covering.cache_clear()


def figure_of(text: str) -> Figure:
    figure = Figure()
    figure.text(0.5, 0.5, text)
    return figure


def only(monkeypatch: pytest.MonkeyPatch, *paths: str) -> None:
    monkeypatch.setattr(font_manager, "findSystemFonts", lambda: [*paths, __file__])


def test_an_installed_font_shows_what_the_usual_one_lacks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    only(monkeypatch, PLAIN, OTHER)
    figure = figure_of(f"wheel {HAS}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fonts.cover_text(figure)
        figure.savefig(tmp_path / "figure.png")
    assert figure.texts[0].get_fontfamily()[-1] == "STIXGeneral"


def test_characters_that_no_font_has_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    only(monkeypatch, PLAIN, OTHER)
    with pytest.warns(UserWarning, match=HAS_NOT) as remarks:
        fonts.cover_text(figure_of(f"{HAS} {HAS_NOT}"))
    assert HAS not in str(remarks[0].message)


@pytest.mark.parametrize("text", ["plain", "G\u00f6del \u0394 \u0416 \u2013 \u221e"])
def test_no_font_is_looked_for_where_the_usual_one_will_do(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(font_manager, "findSystemFonts", None)
    figure = figure_of(text)
    fonts.cover_text(figure)
    assert figure.texts[0].get_fontfamily() == ["sans-serif"]
