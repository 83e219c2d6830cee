"""Pictures of hierarchies: superiors left, subordinates right, folded where the chain is long.

Positions are in inches on the figure, so that a name is as large in a picture of 32 agents as in
one of 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core.interface.hierarchy import Hierarchy
from ..core.numerics.arrays import FloatArray
from ..core.plugins.deferred import nx

COLUMNS = 6
"""Levels side by side before the picture is folded."""
WIDTH, HEIGHT = 1.25, 0.3
"""Size of an agent [in]."""
ACROSS, DOWN = 1.7, 0.44
"""Distance of columns and of rows [in]."""
MOST_IMPLIED = 40
"""Edges implied by others that are still drawn: more would only darken the picture."""
COLOURS = ("#cfe2f3", "#fde5cd", "#d9ead3", "#ead1dc", "#fff2cc", "#d0e0e3", "#e6d5c3", "#d9d2e9")
"""Fill of the agents by body, again from the start when they run out."""


def draw(
    hierarchy: Hierarchy,
    path: Path | str,
    *,
    bodies: Sequence[Sequence[int]] | None = None,
    title: str = "",
) -> None:
    """Write a picture of a hierarchy: SVG, PNG or PDF by the suffix of `path`.

    Parameters
    ----------
    hierarchy
        What to draw.
    path
        The file to write.
    bodies
        Agent indices by robot: one colour each. None: one colour.
    title
        Stands above the picture.

    Raises
    ------
    ValueError
        If the suffix is none of these.
    """
    if Path(path).suffix not in (".svg", ".png", ".pdf"):
        raise ValueError(f"{path}: suffix must be .svg, .png or .pdf")
    from matplotlib.figure import Figure

    places = positions(hierarchy)
    low, high = places.min(axis=0), places.max(axis=0)
    span = high - low + np.array([WIDTH, HEIGHT])
    width, height = max(span[0] + 0.6, 4.5), span[1] + 1.1
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    centre = (low[0] + high[0]) / 2
    axes.set_xlim(centre - width / 2, centre + width / 2)
    axes.set_ylim(-high[1] - HEIGHT / 2 - 0.45, -low[1] + HEIGHT / 2 + 0.65)
    _arrows(axes, hierarchy, places)
    _agents(axes, hierarchy, places, bodies)
    top, bottom = axes.get_ylim()[1], axes.get_ylim()[0]
    axes.text(centre, top - 0.27, title, ha="center", va="center", fontsize=10)
    axes.text(
        centre,
        bottom + 0.17,
        _note(hierarchy, bodies),
        ha="center",
        va="center",
        fontsize=7.5,
        color="#555555",
    )
    # Without date and random identifiers, equal hierarchies give equal files.
    metadata = {"Date": None} if Path(path).suffix == ".svg" else None
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "nested-agents", "svg.fonttype": "none"}):
        figure.savefig(path, dpi=150, metadata=metadata)


def positions(hierarchy: Hierarchy) -> FloatArray:
    """Return where the agents are drawn, ``(n, 2)`` [in], y downwards.

    A level holds the agents that are equally many steps, on the longest way, from the top. Levels
    are columns; every `COLUMNS` of them the picture folds and runs back below. Neighbours are on a
    circle.
    """
    n = len(hierarchy)
    if hierarchy.neighbours:  # all lines between agents on a circle can be seen
        radius = max(0.9, 1.15 * WIDTH / (2.0 * np.sin(np.pi / max(n, 2))))
        turns = 2.0 * np.pi * np.arange(n) / n
        return radius * np.stack([np.sin(turns), -np.cos(turns)], axis=1)
    if not hierarchy.edges:
        rows = max(1, round(n**0.5))
        grid = np.array([[i // rows * ACROSS, i % rows * DOWN] for i in range(n)], dtype=float)
        return grid
    levels = _levels(hierarchy)
    rows_of = _rows(hierarchy, levels)
    if len(levels) > COLUMNS:  # a long picture would climb or sink: keep to the top of each band
        for level in levels:
            rank = sorted(level, key=lambda i: (-len(hierarchy.below(i)), rows_of[i]))
            rows_of.update((i, float(row)) for row, i in enumerate(rank))
    places = np.zeros((n, 2))
    top = 0.0
    for first in range(0, len(levels), COLUMNS):
        band = levels[first : first + COLUMNS]
        inside = [i for level in band for i in level]
        lowest = min(rows_of[i] for i in inside)
        back = first // COLUMNS % 2 == 1
        for k, level in enumerate(band):
            x = (COLUMNS - 1 - k if back else k) * ACROSS
            for i in level:
                places[i] = x, top + (rows_of[i] - lowest) * DOWN
        top += (max(rows_of[i] for i in inside) - lowest) * DOWN + 2.2 * DOWN
    return places


def _levels(hierarchy: Hierarchy) -> list[list[int]]:
    graph = nx.DiGraph(hierarchy.edges)
    graph.add_nodes_from(range(len(hierarchy)))
    return [sorted(level) for level in nx.topological_generations(graph)]


def _rows(hierarchy: Hierarchy, levels: list[list[int]]) -> dict[int, float]:
    """Return a row for every agent, near those of its neighbours in the levels next to it."""
    neighbours: dict[int, list[int]] = {i: [] for i in range(len(hierarchy))}
    for a, b in hierarchy.edges:
        neighbours[a].append(b)
        neighbours[b].append(a)
    largest = max(range(len(levels)), key=lambda k: len(levels[k]))
    rows: dict[int, float] = {}
    # A first pass from the top settles the order in the largest level, from which both ways go.
    for outward in (range(len(levels)), range(largest, len(levels)), range(largest - 1, -1, -1)):
        for k in outward:
            settled = {i: rows[i] for i in rows if i not in levels[k]}
            beside = set(levels[k - 1] if k > 0 else []) | set(
                levels[k + 1] if k + 1 < len(levels) else []
            )
            wanted = {}
            for i in levels[k]:
                near = [settled[j] for j in neighbours[i] if j in settled and j in beside]
                near = near or [settled[j] for j in neighbours[i] if j in settled]
                wanted[i] = float(np.mean(near)) if near else rows.get(i, 0.0)
            rank = sorted(levels[k], key=lambda i: (wanted[i], -len(hierarchy.below(i)), i))
            spread = _spaced([wanted[i] for i in rank])
            rows.update(zip(rank, spread, strict=True))
    return rows


def _spaced(wanted: list[float]) -> list[float]:
    """Return increasing rows at least 1 apart, as near as possible to sorted `wanted` ones."""
    blocks: list[tuple[float, int]] = []  # mean offset and size: pool adjacent violators
    for k, row in enumerate(wanted):
        blocks.append((row - k, 1))
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            (m, size), (m2, size2) = blocks[-2], blocks[-1]
            blocks[-2:] = [((m * size + m2 * size2) / (size + size2), size + size2)]
    offsets = [mean for mean, size in blocks for _ in range(size)]
    return [offset + k for k, offset in enumerate(offsets)]


def _implied(hierarchy: Hierarchy) -> set[tuple[int, int]]:
    """Return the edges without which everyone would see the same agents."""
    return set(hierarchy.edges) - set(nx.transitive_reduction(nx.DiGraph(hierarchy.edges)).edges)


def _note(hierarchy: Hierarchy, bodies: Sequence[Sequence[int]] | None) -> str:
    if hierarchy.neighbours:
        return "lines: neighbours, who decide at the same time"
    implied = len(_implied(hierarchy))
    grey = "grey arrows: implied by the others"
    hidden = f"{implied} edges implied by the others are not shown"
    notes = ["numbers: order of decision"]
    if bodies and max(map(len, bodies)) > 1:
        notes.append("colours: bodies")
    if implied:
        notes.append(hidden if implied > MOST_IMPLIED else grey)
    return "; ".join(notes)


def _arrows(axes, hierarchy: Hierarchy, places: FloatArray) -> None:  # type: ignore[no-untyped-def]
    from matplotlib.patches import FancyArrowPatch

    for a, b in hierarchy.neighbours:
        ends = places[[a, b]]
        axes.plot(ends[:, 0], -ends[:, 1], color="#444444", linewidth=0.8, zorder=1)
    implied = _implied(hierarchy)
    shown = [e for e in hierarchy.edges if len(implied) <= MOST_IMPLIED or e not in implied]
    for edge in shown:
        start, end, bend = _route(places[edge[0]] * (1, -1), places[edge[1]] * (1, -1))
        axes.add_patch(
            FancyArrowPatch(
                tuple(start),
                tuple(end),
                arrowstyle="-|>",
                mutation_scale=8,
                shrinkA=0,
                shrinkB=0,
                linewidth=0.6 if edge in implied else 1.0,
                color="#c4c4c4" if edge in implied else "#444444",
                connectionstyle=f"arc3,rad={bend}",
                zorder=1 if edge in implied else 2,
            )
        )


def _route(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return start, end and bend of the arrow between agents centred at a and b."""
    across, down = b - a
    if abs(across) < ACROSS / 2:  # where the picture folds: around the outside
        side = 1.0 if a[0] > ACROSS * (COLUMNS - 1) / 2 else -1.0
        edge = np.array([side * WIDTH / 2, 0.0])
        return a + edge, b + edge, side * 0.4 / down
    edge = np.array([np.sign(across) * WIDTH / 2, 0.0])
    # Past a column in between, a straight arrow would run through its agents.
    return a + edge, b - edge, 0.12 if abs(across) > 1.5 * ACROSS else 0.0


def _agents(axes, hierarchy: Hierarchy, places: FloatArray, bodies) -> None:  # type: ignore[no-untyped-def]
    from matplotlib.patches import FancyBboxPatch

    body_of = {i: g for g, members in enumerate(bodies or []) for i in members}
    for rank, i in enumerate(hierarchy.order):
        x, y = places[i][0], -places[i][1]
        axes.add_patch(
            FancyBboxPatch(
                (x - WIDTH / 2 + 0.05, y - HEIGHT / 2 + 0.05),
                WIDTH - 0.1,
                HEIGHT - 0.1,
                boxstyle="round,pad=0.05",
                facecolor=COLOURS[body_of.get(i, 0) % len(COLOURS)],
                edgecolor="#666666",
                linewidth=0.8,
                zorder=3,
            )
        )
        name = hierarchy.agents[i]
        size = min(8.5, 8.5 * 15 / max(len(name), 1))
        axes.text(
            x - WIDTH / 2 + 0.07, y, str(rank + 1), fontsize=6.5, va="center", color="#777777",
            zorder=4,
        )  # fmt: skip
        axes.text(x + 0.06, y - 0.01, name, fontsize=size, ha="center", va="center", zorder=4)
