"""Figures of an explanation: functions of one variable, pairs, policy, self-model."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import MultipleLocator

from ...core.numerics.arrays import FloatArray
from ...scenarios.box_pushing.config import BoxPushingSettings
from ...scenarios.box_pushing.world.boxes import BoxSpec, box_for
from ...scenarios.box_pushing.world.robots import robot_for
from ..presentation.figures import COLOURS, MARKERS, SETTINGS, STYLES
from .body import ROWS, Bodies, body_name, by_robot
from .policy import AROUND, MOVES, Field
from .rules import exponent, labels, percent, strongest_pairs
from .team import Explained

MOST_LINES = 8
"""Agents in one figure of functions."""
MOST_MAPS = 4
"""Agents in the figure of pairs."""
MOST_BODIES = 8
"""Robots in the figure of the self-model."""
MOVE_COLOURS = dict(zip(MOVES, ("#0072B2", "#D55E00", "#009E73", "#999999"), strict=True))


def draw(found: Explained) -> dict[str, Figure]:
    """Return all figures that there is something for, by name."""
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        return dict(_figures(found))


def _figures(found: Explained) -> Iterator[tuple[str, Figure]]:
    if any(p.variance > 0 for p in found.parts):
        blocks = range(0, len(found.agents), MOST_LINES)
        for number, first in enumerate(blocks, 1):
            name = "functions" if len(blocks) == 1 else f"functions-{number}"
            yield name, _functions(found, slice(first, first + MOST_LINES))
        if strongest_pairs(found.parts):
            yield "pairs", _pairs(found)
    if not isinstance(found.fields, str):
        yield "policy", _policy(found, found.fields)
    if found.bodies is not None:
        yield "self-model", _bodies(found.wheels, found.bodies)


def _functions(found: Explained, block: slice) -> Figure:
    d = len(found.variables)
    columns = 4 if d > 3 else d
    rows = ceil(d / columns)
    figure = Figure(figsize=(2.45 * columns, 2.2 * rows + 0.7), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    times = 10.0 ** exponent(found.parts)
    names, parts = found.agents[block], found.parts[block]
    robots = list(dict.fromkeys(name.partition(".")[0] for name in names))
    for j, (variable, partition) in enumerate(
        zip(found.variables, found.rules.partitions, strict=True)
    ):
        axes, turn = panels[j], 180 / np.pi if variable.unit == "rad" else 1.0
        low, high = (min(partition.centres), max(partition.centres))
        if variable.periodic:
            low, high = variable.low, variable.high
        if variable.unit == "rad":
            axes.xaxis.set_major_locator(MultipleLocator(90))
        x = np.union1d(np.linspace(low, high, 401), partition.centres)
        strengths = partition.strengths(x)
        for i, (name, part) in enumerate(zip(names, parts, strict=True)):
            robot = name.partition(".")[0]
            wheel = [n for n in names if n.partition(".")[0] == robot].index(name)
            number = robots.index(robot)
            look: dict[str, Any] = {
                "color": COLOURS[number % len(COLOURS)], "ls": STYLES[wheel % len(STYLES)],
                "marker": MARKERS[number % len(MARKERS)], "ms": 3,
            }  # fmt: skip
            at = np.searchsorted(x, partition.centres)
            line = axes.plot(
                turn * x, times * strengths @ part.singles[j], lw=1.4, markevery=at.tolist(), **look
            )[0]
            line.set_label(name if j == 0 else f"_{i}")
        share = float(np.mean([p.share(p.singles[j]) for p in parts]))
        unit = {"rad": " [°]", "1": ""}.get(variable.unit, f" [{variable.unit}]")
        axes.set_title(f"{variable.name}{unit}, {percent(share)}", loc="left")
        axes.axhline(0.0, color="#cccccc", lw=0.8, zorder=0)
    for axes in panels[d:]:
        axes.set_visible(False)
    power = exponent(found.parts)
    figure.supylabel("adds to f" + (rf" [$\times 10^{{{-power}}}$]" if power else ""), fontsize=9)
    figure.legend(
        loc="outside lower center", ncols=4, frameon=False,
        title="markers: rules, less their mean; in the titles the share of the variance of f",
    )  # fmt: skip
    return figure


def _pairs(found: Explained) -> Figure:
    pairs, parts = strongest_pairs(found.parts), found.parts[:MOST_MAPS]
    figure = Figure(figsize=(2.5 * len(parts) + 1.2, 2.4 * len(pairs) + 0.3), layout="constrained")
    panels = figure.subplots(len(pairs), len(parts), squeeze=False)
    times = 10.0 ** exponent(found.parts)
    greatest = max(float(np.abs(p.pairs[pair]).max()) for p in parts for pair in pairs) * times
    for row, (j, k) in zip(panels, pairs, strict=True):
        words = [labels(found.variables[i], found.rules.partitions[i]) for i in (j, k)]
        for axes, name, part in zip(row, found.agents, parts, strict=False):
            image = axes.imshow(
                times * part.pairs[j, k], cmap="cividis", vmin=-greatest, vmax=greatest,
                origin="lower", aspect="auto",
            )  # fmt: skip
            axes.set_title(f"{name}, {percent(part.share(part.pairs[j, k]))}", loc="left")
            axes.set_xticks(range(len(words[1])), words[1], rotation=40, ha="right", fontsize=7)
            axes.set_yticks(range(len(words[0])), words[0], fontsize=7)
            axes.set_xlabel(found.variables[k].name)
        row[0].set_ylabel(found.variables[j].name)
    power = exponent(found.parts)
    scale = rf" [$\times 10^{{{-power}}}$]" if power else ""
    figure.colorbar(image, ax=panels, label=f"adds to f beyond either alone{scale}", shrink=0.8)
    return figure


def _policy(found: Explained, fields: list[Field]) -> Figure:
    settings = found.trial.settings.scenario
    assert isinstance(settings, BoxPushingSettings)  # no other scenario has fields
    box, robot = box_for(settings.box, settings.robots), robot_for(settings.robot)
    columns = min(2, len(fields))
    rows = ceil(len(fields) / columns)
    figure = Figure(figsize=(4.1 * columns, 4.3 * rows + 0.9), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, field in zip(panels, fields, strict=False):
        _field(axes, field, box, robot.radius)
    for axes in panels[len(fields) :]:
        axes.set_visible(False)
    handles = [
        mpl.lines.Line2D([], [], ls="", marker="o", ms=6, color=colour, label=move)
        for move, colour in MOVE_COLOURS.items()
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, frameon=False,
        title="what a robot at rest, looking at the box, does next; grey discs: the other robots",
    )  # fmt: skip
    return figure


def _field(axes: Axes, field: Field, box: BoxSpec, radius: float) -> None:
    reach = box.reach + AROUND
    spacing = 2 * reach / 16
    moves = np.array(field.moves)
    colours = [MOVE_COLOURS[move] for move in moves]
    longest = max(float(np.hypot(*field.ways.T).max()), 1e-9)
    ways = 0.9 * spacing * field.ways / longest
    axes.add_patch(PathPatch(_outline(box), fc="#E69F00", ec="black", alpha=0.75))
    for place in field.others:
        axes.add_patch(Circle((place[0], place[1]), radius, fc="#bbbbbb", ec="#777777"))
    axes.quiver(
        *field.points[:, :2].T, *ways.T, color=colours,
        angles="xy", scale_units="xy", scale=1.0, width=0.006, headwidth=4, headlength=4.5,
    )  # fmt: skip
    for move, turning in (("turns", True), ("rests", False)):
        here = moves == move
        if not here.any():
            continue
        look: dict[str, Any] = {"color": MOVE_COLOURS[move], "ls": ""}
        if not turning:
            axes.plot(*field.points[here, :2].T, marker=".", ms=3, **look)
            continue
        for sign, marker in ((1, r"$\circlearrowleft$"), (-1, r"$\circlearrowright$")):
            own = here & (np.sign(field.turns) == sign)
            axes.plot(*field.points[own, :2].T, marker=marker, ms=7, **look)
    axes.arrow(0, 0, 0.6 * box.reach, 0, width=0.004, head_width=0.02, color="black")
    axes.text(0.25 * box.reach, 0.03, "to the goal", ha="center", fontsize=7)
    axes.set_xlim(-reach - spacing, reach + spacing)
    axes.set_ylim(-reach - spacing, reach + spacing)
    axes.set_box_aspect(1.0)  # a square of equal lengths; `set_aspect` would cut the title off
    axes.set_title(f"robot {field.robot + 1}; longest arrow {1000 * longest:.0f} mm", loc="left")
    axes.set_xlabel("along the course to the goal [m]")


def _outline(box: BoxSpec) -> Outline:
    if box.polygon is None:
        return Outline.circle((0, 0), box.radius)
    rings = [np.array(r.coords) for r in (box.polygon.exterior, *box.polygon.interiors)]
    return Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))


def _bodies(wheels: tuple[str, ...], bodies: Bodies) -> Figure:
    moments = bodies.moments
    robots = min(len(moments["built"]), MOST_BODIES)
    every = [effect for effects in moments.values() for effect in effects]
    # What no body does is not drawn: a joint can but turn.
    rows = [k for k in range(len(ROWS)) if any(effect[k, :-1].any() for effect in every)]
    figure = Figure(figsize=(8.0, 1.9 * robots + 0.6), layout="constrained")
    panels = figure.subplots(robots, len(rows), squeeze=False)
    # All robots on one scale, and ahead and left too, which have one unit.
    extent = {unit: [0.0] for _, unit in ROWS}
    for effect in every:
        for row, (_, unit) in enumerate(ROWS):
            extent[unit] += effect[row, :-1].tolist()
    limits = {name: (1.08 * min(extent[unit]), 1.08 * max(extent[unit])) for name, unit in ROWS}
    for r, (axes_row, own) in enumerate(zip(panels, by_robot(bodies, wheels), strict=False)):
        names = [name.rpartition(".")[2] for name in own]
        for axes, row in zip(axes_row, rows, strict=True):
            name, unit = ROWS[row]
            _bars(axes, names, {m: effects[r][row, :-1] for m, effects in moments.items()})
            axes.set_ylim(limits[name])
            if r == 0:
                axes.set_title(f"{name} [{unit} per m/s]", loc="left")
        axes_row[0].set_ylabel(body_name(own, r))
    handles, titles = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, titles, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _bars(axes: Axes, names: list[str], values: dict[str, FloatArray]) -> None:
    wide = 0.8 / len(values)
    for i, (moment, heights) in enumerate(values.items()):
        at = np.arange(len(names)) + (i - (len(values) - 1) / 2) * wide
        colour = ("#bbbbbb", COLOURS[0], COLOURS[1])[i if len(values) == 3 else 2 * i]
        axes.bar(at, heights, wide, color=colour, label=moment)
    axes.axhline(0.0, color="black", lw=0.6)
    axes.set_xticks(range(len(names)), names, fontsize=7, rotation=20 if len(names) > 2 else 0)
