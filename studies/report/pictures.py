"""The figures of a study: as SVG to stand in a page, and as PDF to take away."""

import base64
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass

from markupsafe import Markup
from matplotlib.figure import Figure

from ..presentation.figures import styled


@dataclass(frozen=True)
class Picture:
    """A figure."""

    name: str
    """Its file's, without suffix."""
    svg: Markup
    """An element that can stand in a page beside others."""
    pdf: str
    """The same figure, in base64."""

    @property
    def title(self) -> str:
        """The name in words."""
        return self.name.replace("-", " ").replace("_", " ")


def pictures(figures: Mapping[str, Figure]) -> list[Picture]:
    """Return a study's figures, by name, as they stand in a page and are taken away from it."""
    drawn = []
    with styled():
        for number, (name, figure) in enumerate(figures.items(), 1):
            svg = io.StringIO()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            text = embedded(svg.getvalue(), f"figure{number}-")
            pdf = io.BytesIO()
            figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
            encoded = base64.b64encode(pdf.getvalue()).decode("ascii")
            drawn.append(Picture(name, Markup(text), encoded))
    return drawn


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
