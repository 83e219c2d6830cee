"""Figures and hierarchies of a study as elements of an HTML page."""

import base64
import io
import re
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice
from typing import NamedTuple

from markupsafe import Markup
from matplotlib.figure import Figure

from ...topologies.drawing import picture
from ..errors import SpecError
from ..presentation.figures import apply_style
from ..store.store import Store
from ..trials.hierarchies import hierarchies_of
from ..trials.keeping import spec_of

MAX_HIERARCHIES = 4
"""Maximum number of hierarchies that are drawn."""
MAX_AGENTS = 64
"""Maximum number of agents of a hierarchy that is drawn."""
PANEL_MARGIN = 4.0
"""Margin around a panel that is shown on its own [pt]."""


class Picture(NamedTuple):
    """A figure."""

    name: str
    """File name without suffix."""
    svg: Markup
    """SVG element with ids that differ from those of other figures in the page."""
    pdf: str
    """The same figure as PDF, in base64."""
    prefix: str
    """Prefix of the ids in the SVG element."""
    panels: tuple[str, ...]
    """View boxes of the panels and of the legend, which narrow screens stack; empty for one."""

    @property
    def title(self) -> str:
        """Name with spaces."""
        return self.name.replace("-", " ").replace("_", " ")


def pictures(figures: Mapping[str, Figure], prefix: str = "figure") -> list[Picture]:
    """Return figures as elements of a page with ids that begin with a prefix."""
    drawings = []
    with apply_style():
        for number, (name, figure) in enumerate(figures.items(), 1):
            svg = io.StringIO()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            name_space = f"{prefix}{number}-"
            text = embed(svg.getvalue(), name_space)
            pdf = io.BytesIO()
            figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
            encoded = base64.b64encode(pdf.getvalue()).decode("ascii")
            drawings.append(Picture(name, Markup(text), encoded, name_space, panel_boxes(figure)))
    return drawings


def panel_boxes(figure: Figure) -> tuple[str, ...]:
    """Return the SVG view boxes ``x y width height`` of a figure's panels and legends [pt]."""
    panels = [axes for axes in figure.axes if axes.get_visible()]
    if len(panels) < 2:
        return ()
    scale = 72.0 / figure.dpi
    height = figure.bbox.height * scale
    boxes = []
    for artist in (*figure.legends, *panels):
        box = artist.get_tightbbox()
        if box is not None and box.width > 1.0:
            margin = PANEL_MARGIN if artist in panels else 0.0
            x = box.x0 * scale - margin
            y = height - box.y1 * scale - margin
            sizes = (side * scale + 2 * margin for side in (box.width, box.height))
            boxes.append(" ".join(f"{value:.1f}" for value in (x, y, *sizes)))
    return tuple(boxes)


def embed(svg: str, prefix: str) -> str:
    """Return the root element of an SVG file with a prefix for its ids and its style.

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
    """Return pictures of the first hierarchies of a study.

    Hierarchies that cannot be built here are omitted: those of studies of another version, or of
    files that are not trusted.
    """
    drawings: dict[str, Figure] = {}
    with suppress(SpecError):
        spec = spec_of(store)
        with spec.sources.active():
            for view in islice(hierarchies_of(spec), MAX_HIERARCHIES):
                if len(view.hierarchy) <= MAX_AGENTS:
                    drawings[view.title] = picture(
                        view.hierarchy, bodies=view.bodies, failing=view.failing
                    )
    return pictures(drawings, "hierarchy")
