"""Small picture of a hierarchy as SVG, for notebooks: superiors above, subordinates below.

`nested_agents.topologies.drawing` draws figures for papers with matplotlib.
"""

from collections.abc import Sequence
from html import escape

ACROSS = 96
DOWN = 38
WIDTH = 84
HEIGHT = 22
"""Distances and sizes [px]."""
MAX_AGENTS = 32
"""Maximum number of agents that are drawn; a line of text describes larger hierarchies."""


def svg(
    agents: Sequence[str],
    levels: Sequence[int],
    edges: Sequence[tuple[int, int]],
    neighbors: Sequence[tuple[int, int]] = (),
) -> str:
    """Return an SVG element.

    Parameters
    ----------
    agents
        Names of the agents.
    levels
        Row of every agent, from the top.
    edges
        Pairs (superior, subordinate) of agent indices.
    neighbors
        Pairs of agent indices, joined by dashed lines.

    Examples
    --------
    >>> svg(["a", "b"], [0, 1], [(0, 1)]).count("<rect"), svg("ab", [0, 0], []).count("<line")
    (2, 0)
    """
    rows = [[i for i, own in enumerate(levels) if own == k] for k in sorted({*levels})]
    widest = max(map(len, rows))
    if len(agents) > MAX_AGENTS:
        text = f"{len(agents)} agents, {len(edges) + len(neighbors)} edges, depth {len(rows)}"
        return _element(ACROSS * 4, DOWN, [_text(ACROSS * 2, DOWN / 2, text, len(text))])
    places = {}
    for k, row in enumerate(rows):
        for place, agent in enumerate(row):
            places[agent] = (
                ACROSS * (place + (widest - len(row)) / 2 + 0.5),
                DOWN * (k + 0.5),
            )
    lines = [_line(places[a], places[b], "") for a, b in edges]
    lines += [_line(places[a], places[b], ' stroke-dasharray="3"') for a, b in neighbors]
    boxes = []
    for agent, (x, y) in places.items():
        boxes.append(
            f'<rect x="{x - WIDTH / 2:g}" y="{y - HEIGHT / 2:g}" width="{WIDTH}" '
            f'height="{HEIGHT}" rx="4" fill="#cfe2f3" stroke="#456"/>'
        )
        boxes.append(_text(x, y, agents[agent]))
    return _element(ACROSS * widest, DOWN * len(rows), [*lines, *boxes])


def _element(width: float, height: float, parts: Sequence[str]) -> str:
    size = f'width="{width:g}" height="{height:g}" viewBox="0 0 {width:g} {height:g}"'
    style = 'font-family="sans-serif" font-size="11" text-anchor="middle"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} {style}>{"".join(parts)}</svg>'


def _line(a: tuple[float, float], b: tuple[float, float], style: str) -> str:
    ends = f'x1="{a[0]:g}" y1="{a[1]:g}" x2="{b[0]:g}" y2="{b[1]:g}"'
    return f'<line {ends} stroke="#456"{style}/>'


def _text(x: float, y: float, text: str, max_length: int = 14) -> str:
    shown = text if len(text) <= max_length else f"{text[: max_length - 1]}…"
    return f'<text x="{x:g}" y="{y + 4:g}">{escape(shown)}</text>'
