"""Figures and hierarchies of a study, as they stand in a page."""

import base64
import io
import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice
from typing import NamedTuple

from markupsafe import Markup
from matplotlib.figure import Figure

from ...core.fonts import cover_text
from ...topologies.drawing import picture
from ..errors import SpecError
from ..presentation.figures import apply_style
from ..store.store import Store
from ..trials.hierarchies import hierarchies_of
from ..trials.keeping import spec_of

MOST_DRAWN = 4
"""Hierarchies of a study that are drawn."""
MOST_AGENTS = 64
"""Of a hierarchy that is drawn."""


class Picture(NamedTuple):
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


def pictures(figures: Mapping[str, Figure], prefix: str = "figure") -> list[Picture]:
    """Return a study's figures, by name, as they stand in a page and are taken away from it.

    Their ids begin with a prefix.
    """
    drawings = []
    with apply_style():
        for number, (name, figure) in enumerate(figures.items(), 1):
            cover_text(figure)
            svg = io.StringIO()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            text = embed(svg.getvalue(), f"{prefix}{number}-")
            pdf = io.BytesIO()
            figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
            encoded = base64.b64encode(pdf.getvalue()).decode("ascii")
            drawings.append(Picture(name, Markup(text), encoded))
    return drawings


def embed(svg: str, prefix: str) -> str:
    """Return an SVG file's root element, its ids and its style kept from those of other ones.

    Examples
    --------
    >>> embed('<?xml version="1.0"?><svg><style>*{a: b}</style><g id="x"/></svg>', "f-")
    '<svg id="f-"><style>#f- *{a: b}</style><g id="f-x"/></svg>'
    """
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#{prefix}", svg)
    svg = re.sub(r"(<style[^>]*>)\s*\*", rf"\1#{prefix} *", svg)
    return svg.replace("<svg", f'<svg id="{prefix}"', 1)


def hierarchy_pictures(store: Store) -> list[Picture]:
    """Return pictures of the hierarchies of a study, the first ones, of not too many agents.

    None of what cannot be built here: a study of another version, or of files that nobody trusts.
    """
    drawings: dict[str, Figure] = {}
    with suppress(SpecError):
        spec = spec_of(store)
        with spec.sources.active():
            for view in islice(hierarchies_of(spec), MOST_DRAWN):
                if len(view.hierarchy) <= MOST_AGENTS:
                    drawings[view.title] = picture(
                        view.hierarchy, bodies=view.bodies, failing=view.failing
                    )
    return pictures(drawings, "hierarchy")
