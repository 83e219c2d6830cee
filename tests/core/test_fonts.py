"""Texts of figures in scripts that the usual font lacks."""

import warnings
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from nested_agents.core import fonts

HAS = "\u1d8a"  # a phonetic letter that STIX has and DejaVu Sans has not


def figure_of(text: str) -> Figure:
    figure = Figure()
    figure.text(0.5, 0.5, text)
    return figure


def test_an_installed_font_shows_what_the_usual_one_lacks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(fonts, "FALLBACKS", ("No Such Font", "STIXGeneral"))
    figure = figure_of(f"wheel {HAS}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(2):  # as a figure that is written twice
            fonts.cover_text(figure)
        figure.savefig(tmp_path / "figure.png")
    assert figure.texts[0].get_fontfamily() == ["sans-serif", "STIXGeneral"]


def test_plain_text_keeps_the_usual_font() -> None:
    figure = figure_of("plain")
    fonts.cover_text(figure)
    assert figure.texts[0].get_fontfamily() == ["sans-serif"]
