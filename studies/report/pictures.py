"""The figures of a study, drawn anew: as SVG to stand in a page, and as PDF to take away.

Studies write PNG and SVG. The PDF is made of the same figure: while a study draws, a canvas that
notes which figure was written to which file takes the place of matplotlib's own for SVG.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.backend_bases import register_backend
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ..study import Study


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes
    ----------
    name
        Its file's, without suffix.
    svg
        An element that can stand in a page beside others; none if the study draws no SVG.
    png
        In base64, if there is no SVG.
    pdf
        In base64; empty if it was not drawn by matplotlib.
    """

    name: str
    svg: Markup | None
    png: str
    pdf: str

    @property
    def title(self) -> str:
        """The name in words."""
        return self.name.replace("-", " ").replace("_", " ")


def pictures(study: Study, analysis: Any) -> list[Picture]:
    """Let a study draw its figures and return them in its order."""
    found: list[Picture] = []
    with TemporaryDirectory() as folder:
        # Whatever else the study sets, equal results are to give equal ids.
        with _noted() as figures, mpl.rc_context({"svg.hashsalt": "nested-agents"}):
            paths = study.draw(analysis, Path(folder))
        for name in dict.fromkeys(path.stem for path in paths):
            by_suffix = {path.suffix: path for path in paths if path.stem == name}
            svg, png = by_suffix.get(".svg"), by_suffix.get(".png")
            if svg is not None:
                text = embedded(svg.read_text(encoding="utf-8"), f"figure{len(found) + 1}-")
                figure = figures.get(svg.name)
                found.append(Picture(name, Markup(text), "", _pdf(figure)))
            elif png is not None:
                found.append(Picture(name, None, _base64(png.read_bytes()), ""))
    return found


def embedded(svg: str, prefix: str) -> str:
    """Return an SVG file's root element, its ids and its style kept from those of other ones.

    Examples
    --------
    >>> embedded('<?xml version="1.0"?><svg><style>*{a: b}</style><g id="x"/></svg>', "f-")
    '<svg id="f-"><style>#f- *{a: b}</style><g id="f-x"/></svg>'
    """
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#{prefix}", svg)
    svg = re.sub(r"(<style[^>]*>)\s*\*", rf"\1#{prefix} *", svg)
    return svg.replace("<svg", f'<svg id="{prefix}"', 1)


@contextmanager
def _noted() -> Iterator[dict[str, Figure]]:
    """Gather the figures that are written to SVG files meanwhile, by name of the file."""
    figures: dict[str, Figure] = {}

    class Noting(FigureCanvasSVG):
        def print_svg(self, filename: Any, **options: Any) -> None:
            # From a canvas of its own matplotlib keeps back what concerns other formats only.
            known = {k: v for k, v in options.items() if k in ("bbox_inches_restore", "metadata")}
            super().print_svg(filename, **known)
            if isinstance(filename, str | Path):
                figures[Path(filename).name] = self.figure

    register_backend("svg", Noting)
    try:
        yield figures
    finally:
        register_backend("svg", FigureCanvasSVG)


def _pdf(figure: Figure | None) -> str:
    if figure is None:
        return ""
    file = io.BytesIO()
    figure.savefig(file, format="pdf", metadata={"CreationDate": None})
    return _base64(file.getvalue())


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
