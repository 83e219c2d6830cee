"""Pictures of hierarchies, with superiors on the left and subordinates on the right.

Long chains are folded. Positions are in inches on the figure with y pointing down, so that names
have the same size in all pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from ..core.fonts import cover_text
from ..core.hierarchy.hierarchy import Hierarchy
from ..core.numerics import FloatArray, nx

COLUMNS = 6
"""Levels in a row before the picture is folded."""
WIDTH = 1.25
HEIGHT = 0.32
"""Size of an agent [in]."""
ACROSS = 1.7
DOWN = 0.46
"""Distance of columns and of rows [in]."""
BODY_COLORS = (
    "#cfe2f3",
    "#fde5cd",
    "#d9ead3",
    "#ead1dc",
    "#fff2cc",
    "#d0e0e3",
    "#e6d5c3",
    "#d9d2e9",
)
"""Colors of agents by body; further bodies use them again."""
FONT_SIZE = 8.0
"""Size of names and notes [pt]."""
MAX_CHARACTERS = 14
"""Characters of a name that fit into a line of an agent; a name has two lines at most."""
CHARACTERS_PER_INCH = 16
"""Characters of a note that fit into an inch."""
LUMINANCE = np.array([0.299, 0.587, 0.114])
"""Weights of red, green and blue (ITU-R BT.601)."""


def draw(
    hierarchy: Hierarchy,
    path: Path | str,
    *,
    bodies: Sequence[Sequence[int]] | None = None,
    title: str = "",
    failing: Sequence[int] = (),
) -> None:
    """Write a picture of a hierarchy: SVG, PNG or PDF by the suffix of `path`.

    Parameters
    ----------
    hierarchy
        The hierarchy.
    path
        Path of the file.
    bodies
        Agent indices by body; each body has its own color. By default, all agents have the same.
    title
        Title above the picture.
    failing
        Agents with failing messages, which have a dashed red frame.

    Raises
    ------
    ValueError
        If the suffix is another one.
    """
    if Path(path).suffix not in (".svg", ".png", ".pdf"):
        raise ValueError(f"{path}: suffix must be .svg, .png or .pdf")
    figure = picture(hierarchy, bodies=bodies, title=title, failing=failing)
    cover_text(figure)
    # Without a date and random identifiers, equal hierarchies give equal files.
    metadata = {"Date": None} if Path(path).suffix == ".svg" else None
    with matplotlib.rc_context({"svg.hashsalt": "nested-agents", "svg.fonttype": "none"}):
        figure.savefig(path, dpi=150, metadata=metadata)


def picture(
    hierarchy: Hierarchy,
    *,
    bodies: Sequence[Sequence[int]] | None = None,
    title: str = "",
    failing: Sequence[int] = (),
    fills: Sequence[str] = (),
    note: str = "",
) -> Figure:
    """Return the matplotlib figure of a hierarchy; see `draw` for the other parameters.

    Parameters
    ----------
    fills
        Color of each agent; by default those of the bodies.
    note
        Meaning of these colors.
    """
    places = positions(hierarchy)
    low = places.min(axis=0)
    high = places.max(axis=0)
    # Edges that change neither ancestors nor descendants.
    implied = set(hierarchy.edges) - set(nx.transitive_reduction(nx.DiGraph(hierarchy.edges)).edges)
    head = 0.65 if title else 0.25
    width, height = high - low + (WIDTH + 0.6, HEIGHT + head + 0.35)
    width = max(width, 4.5, 0.09 * len(title))
    notes = [*_notes(hierarchy, bodies), *[note] * bool(note)]
    notes += ["gray arrows: implied by the others"] * bool(implied)
    notes += ["dashed frame: messages fail"] * bool(failing)
    legend = wrap("; ".join(notes), int(CHARACTERS_PER_INCH * width))
    height += 0.15 * len(legend)
    center = (low[0] + high[0]) / 2
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(center - width / 2, center + width / 2)
    top = low[1] - HEIGHT / 2 - head
    axes.set_ylim(top + height, top)
    _arrows(axes, hierarchy, places, implied)
    body_of = {i: number for number, members in enumerate(bodies or []) for i in members}
    body_fills = [BODY_COLORS[body_of.get(i, 0) % len(BODY_COLORS)] for i in range(len(hierarchy))]
    _agents(axes, hierarchy, places, fills or body_fills, failing)
    axes.text(center, top + 0.27, title, fontsize=10, ha="center", va="center", parse_math=False)
    axes.text(
        center, top + height - 0.1, "\n".join(legend),
        fontsize=FONT_SIZE, color="#444444", ha="center", va="bottom",
    )  # fmt: skip
    return figure


def _notes(hierarchy: Hierarchy, bodies: Sequence[Sequence[int]] | None) -> list[str]:
    """Return the meaning of numbers, lines, colors and styles of arrows."""
    notes = ["numbers: decision order"]
    if hierarchy.neighbors:
        notes = ["lines: neighbors, which decide at the same time"]
    elif bodies and max(map(len, bodies)) > 1:
        notes.append("colors: bodies")
    styles = {_style(hierarchy, edge)[1] for edge in hierarchy.edges} - {""}
    return [*notes, *sorted(styles)]


def positions(hierarchy: Hierarchy) -> FloatArray:
    """Return the positions of the agents, ``(n, 2)`` [in].

    The agents of a level have longest paths of the same length from the top. Each level is a column
    in which agents are ordered by the positions of their superiors. After `COLUMNS` levels the
    picture folds and continues below in the opposite direction. Neighbors stand on a circle, so
    that all lines between them are visible.
    """
    n = len(hierarchy)
    if hierarchy.neighbors:
        radius = max(0.9, 1.15 * WIDTH / (2.0 * np.sin(np.pi / max(n, 2))))
        turns = 2.0 * np.pi * np.arange(n) / n
        return radius * np.stack([np.sin(turns), -np.cos(turns)], axis=1)
    graph = nx.DiGraph(hierarchy.edges)
    graph.add_nodes_from(range(n))
    places = np.zeros((n, 2))
    bands = np.zeros(n, dtype=int)
    for number, level in enumerate(nx.topological_generations(graph)):
        heights = {i: np.mean(places[list(graph.pred[i]), 1]) if number else 0.0 for i in level}
        ranked = sorted(level, key=lambda i: (heights[i], -len(hierarchy.searched(i)), i))
        band, column = divmod(number, COLUMNS)
        bands[ranked] = band
        places[ranked, 0] = ACROSS * (COLUMNS - 1 - column if band % 2 else column)
        places[ranked, 1] = DOWN * (np.arange(len(ranked)) - (len(ranked) - 1) / 2)
    for band in range(1, bands.max() + 1):
        lowest = places[bands == band - 1, 1].max() + 2.2 * DOWN
        places[bands == band, 1] += lowest - places[bands == band, 1].min()
    return places


def _arrows(
    axes: Axes, hierarchy: Hierarchy, places: FloatArray, implied: set[tuple[int, int]]
) -> None:
    for a, b in hierarchy.neighbors:
        axes.plot(*places[[a, b]].T, color="#444444", linewidth=0.8, zorder=1)
    for edge in hierarchy.edges:
        color, thickness, order = ("#c4c4c4", 0.6, 1) if edge in implied else ("#444444", 1.0, 2)
        start, end, bend = _route(*places[list(edge)])
        arrow = FancyArrowPatch(
            tuple(start),
            tuple(end),
            connectionstyle=f"arc3,rad={bend}",
            arrowstyle="-|>",
            mutation_scale=8,
            shrinkA=0,
            shrinkB=0,
            linewidth=thickness,
            linestyle=_style(hierarchy, edge)[0],
            color=color,
            zorder=order,
        )
        axes.add_patch(arrow)


def _style(hierarchy: Hierarchy, edge: tuple[int, int]) -> tuple[str, str]:
    """Return the line style of an edge and its entry in the legend, by the relations along it."""
    a, b = edge
    return {
        (True, True): ("-", ""),
        (False, True): ("--", "dashed arrows: lookahead only"),
        (True, False): (":", "dotted arrows: communication only"),
        (False, False): ("", "arrowheads only: neither communication nor lookahead"),
    }[a in hierarchy.senders(b), b in hierarchy.searched(a)]


def _route(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return start, end and bend of the arrow between agents with centers a and b."""
    across, down = b - a
    if abs(across) < ACROSS / 2:  # at a fold of the picture, around the outside
        side = 1.0 if a[0] > ACROSS * (COLUMNS - 1) / 2 else -1.0
        edge = np.array([side * WIDTH / 2, 0.0])
        return a + edge, b + edge, -side * 0.4 / down
    edge = np.array([np.sign(across) * WIDTH / 2, 0.0])
    # A straight arrow across a column would run through its agents.
    return a + edge, b - edge, 0.12 if abs(across) > 1.5 * ACROSS else 0.0


def _agents(
    axes: Axes,
    hierarchy: Hierarchy,
    places: FloatArray,
    fills: Sequence[str],
    failing: Sequence[int],
) -> None:
    for rank, i in enumerate(hierarchy.order, 1):
        x, y = places[i]
        corner = x - WIDTH / 2 + 0.05, y - HEIGHT / 2 + 0.05
        box = FancyBboxPatch(
            corner,
            WIDTH - 0.1,
            HEIGHT - 0.1,
            boxstyle="round,pad=0.05",
            facecolor=fills[i],
            edgecolor="#B00020" if i in failing else "#666666",
            linestyle="--" if i in failing else "-",
            linewidth=0.8,
            zorder=3,
        )
        axes.add_patch(box)
        ink = "black" if np.array(to_rgb(fills[i])) @ LUMINANCE > 0.5 else "white"
        style: dict[str, Any] = {"fontsize": FONT_SIZE, "va": "center", "color": ink, "zorder": 4}
        axes.text(x - WIDTH / 2 + 0.07, y, str(rank), **style)
        name = axes.text(x + 0.08, y, _in_two_lines(hierarchy.agents[i]), ha="center", **style)
        name.set(linespacing=1.0, parse_math=False)


def _in_two_lines(name: str) -> str:
    r"""Return a name in at most two lines, without its middle if it is too long.

    >>> _in_two_lines("robot1.left"), _in_two_lines("north.junction12")
    ('robot1.left', 'north.\njunction12')
    """
    if len(name) <= MAX_CHARACTERS:
        return name
    if len(name) <= 2 * MAX_CHARACTERS:
        end = name.rfind(".", 0, MAX_CHARACTERS) + 1
        half = end if len(name) - end <= MAX_CHARACTERS else -(-len(name) // 2)
        return f"{name[:half]}\n{name[half:]}"
    return f"{name[: MAX_CHARACTERS - 1]}…\n{name[-MAX_CHARACTERS:]}"
