"""Figures of an explanation: functions of one variable, policy, self-model."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from ...core.numerics.arrays import FloatArray
from ..presentation import figures
from ..presentation.figures import COLOURS, add_legend, look, marker
from .body import ROWS, Bodies, body_name, by_body
from .rules import exponent, percent
from .team import Explanation

MOST_LINES = 8
"""Agents in one figure of functions."""
MOST_BODIES = 8
"""Bodies in the figure of the self-model."""


def draw(explained: Explanation) -> dict[str, Figure]:
    """Return all figures that there is something for, by name."""
    with figures.styled():
        return dict(_figures(explained))


def _figures(explained: Explanation) -> Iterator[tuple[str, Figure]]:
    if any(p.variance > 0 for p in explained.parts):
        blocks = range(0, len(explained.agents), MOST_LINES)
        for number, first in enumerate(blocks, 1):
            name = "functions" if len(blocks) == 1 else f"functions-{number}"
            yield name, _functions(explained, slice(first, first + MOST_LINES))
    if not isinstance(explained.policy, str):
        yield "policy", explained.policy.figure()
    if explained.bodies is not None:
        yield "self-model", _bodies(explained.actuators, explained.bodies)


def _functions(explained: Explanation, block: slice) -> Figure:
    d = len(explained.variables)
    columns = 4 if d > 3 else d
    rows = ceil(d / columns)
    size = 2.45 * columns, 2.2 * rows + 0.7
    figure, panels = figures.panels(rows, columns, size, sharey=True)
    panels = panels.ravel()
    power = exponent(explained.parts)
    names, parts = explained.agents[block], explained.parts[block]
    bodies = list(dict.fromkeys(name.partition(".")[0] for name in names))
    for j, (variable, partition) in enumerate(
        zip(explained.variables, explained.rules.partitions, strict=True)
    ):
        axes, turn = panels[j], 180 / np.pi if variable.unit == "rad" else 1.0
        low, high = (min(partition.centres), max(partition.centres))
        if variable.periodic:
            low, high = variable.low, variable.high
        if variable.unit == "rad":
            axes.xaxis.set_major_locator(MultipleLocator(90))
        x = np.union1d(np.linspace(low, high, 401), partition.centres)
        strengths = partition.strengths(x)
        for name, part in zip(names, parts, strict=True):
            body = name.partition(".")[0]
            member = [n for n in names if n.partition(".")[0] == body].index(name)
            number = bodies.index(body)
            style = look(number) | {"ls": look(member)["ls"], "marker": marker(number), "ms": 3}
            at = np.searchsorted(x, partition.centres).tolist()
            y = 10.0**power * strengths @ part.singles[j]
            axes.plot(turn * x, y, lw=1.4, markevery=at, label=name, **style)
        share = float(np.mean([p.share(p.singles[j]) for p in parts]))
        unit = {"rad": " [°]", "1": ""}.get(variable.unit, f" [{variable.unit}]")
        axes.set_title(f"{variable.name}{unit}, {percent(share)}", loc="left")
        axes.axhline(0.0, color="#cccccc", lw=0.8, zorder=0)
    for axes in panels[d:]:
        axes.set_visible(False)
    scale = rf" [$\times 10^{{{-power}}}$]" if power else ""
    figure.supylabel(f"adds to f{scale}", fontsize=9)
    title = "markers: rules, less their mean; in the titles the share of the variance of f"
    add_legend(figure, panels[0].get_lines()[: len(names)], title)
    return figure


def _bodies(actuators: tuple[str, ...], bodies: Bodies) -> Figure:
    moments = bodies.moments
    n_bodies = min(len(moments["built"]), MOST_BODIES)
    every = [effect for effects in moments.values() for effect in effects]
    # What no body does is not drawn: a joint can but turn.
    rows = [k for k in range(len(ROWS)) if any(effect[k, :-1].any() for effect in every)]
    figure, panels = figures.panels(n_bodies, len(rows), (8.0, 1.9 * n_bodies + 0.6))
    # All bodies on one scale, and ahead and left too, which have one unit.
    extent = {unit: [0.0] for _, unit in ROWS}
    for effect in every:
        for row, (_, unit) in enumerate(ROWS):
            extent[unit] += effect[row, :-1].tolist()
    limits = {name: (1.08 * min(extent[unit]), 1.08 * max(extent[unit])) for name, unit in ROWS}
    for r, (axes_row, own) in enumerate(zip(panels, by_body(bodies, actuators), strict=False)):
        names = [name.rpartition(".")[2] for name in own]
        for axes, row in zip(axes_row, rows, strict=True):
            name, unit = ROWS[row]
            _bars(axes, names, {m: effects[r][row, :-1] for m, effects in moments.items()})
            axes.set_ylim(limits[name])
            if r == 0:
                axes.set_title(f"{name} [{unit} per m/s]", loc="left")
        axes_row[0].set_ylabel(body_name(own))
    handles, _ = panels[0][0].get_legend_handles_labels()
    add_legend(figure, handles)
    return figure


def _bars(axes: Axes, names: list[str], values: dict[str, FloatArray]) -> None:
    wide = 0.8 / len(values)
    for i, (moment, heights) in enumerate(values.items()):
        at = np.arange(len(names)) + (i - (len(values) - 1) / 2) * wide
        colour = ("#bbbbbb", COLOURS[0], COLOURS[1])[i if len(values) == 3 else 2 * i]
        axes.bar(at, heights, wide, color=colour, label=moment)
    axes.axhline(0.0, color="black", lw=0.6)
    axes.set_xticks(range(len(names)), names, fontsize=7, rotation=20 if len(names) > 2 else 0)
