"""Figures and hierarchies of a study as elements of an HTML page."""

import base64
import io
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox, BboxBase

from ...core.fonts import cover_text
from ...topologies.drawing import picture
from ...topologies.view import HierarchyView
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
TICK = 5.0
"""Width of the ticks of a vertical axis [pt]."""


Picture = dict[str, Any]
"""A figure of a page: its ``name``, the file name without suffix; ``title``; ``svg``, an element
with ids that begin with ``prefix``, so that they differ from those of other figures; ``pdf``, the
same figure in base64; ``panels``, the panels and legends that narrow screens stack."""


def pictures(figures: Mapping[str, Figure], prefix: str = "figure") -> list[Picture]:
    """Return figures as elements of a page with ids that begin with a prefix."""
    drawings = []
    with apply_style():
        for number, (name, figure) in enumerate(figures.items(), 1):
            cover_text(figure)
            svg, pdf = io.StringIO(), io.BytesIO()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
            drawings.append(
                {
                    "name": name,
                    "title": name.replace("-", " ").replace("_", " "),
                    "svg": Markup(embed(svg.getvalue(), f"{prefix}{number}-")),
                    "pdf": base64.b64encode(pdf.getvalue()).decode("ascii"),
                    "prefix": f"{prefix}{number}-",
                    "panels": crops_of(figure),
                }
            )
    return drawings


def crops_of(figure: Figure) -> list[dict[str, object]]:
    """Return the legends and the panels of a figure; nothing of a figure with one panel.

    Each has its width and height, and its parts side by side [pt]: the distance of a part from the
    left edge, and its view box in the figure. A panel that shares the vertical axis of the first
    panel in its row is shown next to that axis.
    """
    panels = [axes for axes in figure.axes if axes.get_visible()]
    if len(panels) < 2:
        return []
    crops = [_crop(figure, [legend.get_window_extent()]) for legend in figure.legends]
    ticks, margin = (size * figure.dpi / 72.0 for size in (TICK, PANEL_MARGIN))
    for axes in panels:
        own = _extent(axes).padded(margin)
        siblings = axes.get_shared_y_axes().get_siblings(axes)
        row = [sibling for sibling in siblings if sibling.bbox.y0 == axes.bbox.y0]
        first = min(row, key=lambda sibling: sibling.bbox.x0)
        left = _extent(first).x0 - margin
        axis = Bbox.from_extents(left, own.y0, first.bbox.x0 - ticks, own.y1)
        panel = Bbox.from_extents(axes.bbox.x0 - ticks, own.y0, own.x1, own.y1)
        crops.append(_crop(figure, [own] if first is axes else [axis, panel]))
    return crops


def _extent(axes: Axes) -> BboxBase:
    """Return the box of a panel with its labels [pixels]."""
    return axes.get_tightbbox() or axes.bbox


def _crop(figure: Figure, boxes: Sequence[BboxBase]) -> dict[str, object]:
    """Return parts of a figure side by side; boxes have a common height [pixels]."""
    scale = 72.0 / figure.dpi
    ends = np.cumsum([0.0, *(scale * box.width for box in boxes)]).round(1).tolist()
    parts = []
    for x, box in zip(ends, boxes, strict=False):
        places = (box.x0, figure.bbox.height - box.y1, box.width, box.height)
        parts.append((x, " ".join(f"{scale * value:.1f}" for value in places)))
    return {"width": ends[-1], "height": round(scale * boxes[0].height, 1), "parts": parts}


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


def hierarchy_pictures(store: Store) -> tuple[list[Picture], str]:
    """Return pictures of the first hierarchies of a study, and a remark if there are more.

    Hierarchies that cannot be built here are omitted: those of studies of another version, or of
    files that are not trusted.
    """
    views: list[HierarchyView] = []
    with suppress(SpecError):
        spec = spec_of(store)
        with spec.sources.active():
            views = hierarchies_of(spec)
    small = [view for view in views if len(view.hierarchy) <= MAX_AGENTS]
    drawings = {
        view.title: picture(view.hierarchy, bodies=view.bodies, failing=view.failing)
        for view in small[:MAX_HIERARCHIES]
    }
    remark = ""
    if len(drawings) < len(views):
        remark = f"{len(drawings)} of {len(views)} hierarchies are shown."
    if large := [view.text for view in views if len(view.hierarchy) > MAX_AGENTS]:
        remark += f" Too large for a picture (more than {MAX_AGENTS} agents): {'; '.join(large)}."
    return pictures(drawings, "hierarchy"), remark
