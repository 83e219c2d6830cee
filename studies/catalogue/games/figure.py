"""The figure of the games study: a panel for each game, the systems one below the other."""

from __future__ import annotations

from math import ceil

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...presentation.figures import COLOURS, MARKERS, SETTINGS
from .analysis import Games

COLUMNS = 3
APART = 0.2
"""How far the points of one system stand apart, in rows."""


def figure_of(analysis: Games) -> Figure:
    """Return the figure: probabilities of the optimum with their 95 % intervals.

    A panel for each game (the first thing that settings differ in), a colour and a marker for the
    rest of the setting; what is filled has been measured after all plays.
    """
    cases = analysis.cases
    systems = list(dict.fromkeys(case.system for case in cases))
    games = list(dict.fromkeys(case.setting[:1] for case in cases))
    rests = list(dict.fromkeys(case.setting[1:] for case in cases))
    plays = sorted({count for case in cases for count in case.found})
    looks = [(rest, count) for rest in rests for count in plays]
    rows = ceil(len(games) / COLUMNS)
    columns = min(COLUMNS, len(games))
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        height = 0.9 + rows * (0.5 + 0.24 * len(systems))
        figure = Figure(figsize=(1.8 + 2.3 * columns, height), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes, game in zip(panels.flat, games, strict=False):
            axes.set_title(", ".join(game), loc="left")
            for case in (case for case in cases if case.setting[:1] == game):
                for count, e in case.found.items():
                    which = looks.index((case.setting[1:], count))
                    y = systems.index(case.system) + APART * (which - (len(looks) - 1) / 2)
                    rest = rests.index(case.setting[1:])
                    colour, marker = COLOURS[rest % len(COLOURS)], MARKERS[rest % len(MARKERS)]
                    filled = colour if count == plays[-1] else "white"
                    axes.plot([float(e.low), float(e.high)], [y, y], color=colour, linewidth=1.0)
                    axes.plot(
                        float(e.value), y, marker, color=colour, markerfacecolor=filled,
                        markersize=3.5,
                    )  # fmt: skip
            axes.set_xlim(-0.03, 1.03)
            axes.set_yticks(np.arange(len(systems)), systems)
            axes.grid(axis="x", alpha=0.25)
            for line in np.arange(len(systems) - 1) + 0.5:
                axes.axhline(line, color="#e4e4e4", linewidth=0.6, zorder=0)
        panels[0][0].set_ylim(len(systems) - 0.5, -0.5)
        for axes in panels.flat[len(games) :]:
            axes.set_axis_off()
        for axes in panels[-1]:
            axes.set_xlabel("P(optimal joint action)")
        _legend(figure, looks, rests, plays)
        return figure


def _legend(
    figure: Figure,
    looks: list[tuple[tuple[str, ...], int]],
    rests: list[tuple[str, ...]],
    plays: list[int],
) -> None:
    handles = []
    for rest, count in looks:
        which = rests.index(rest)
        colour, marker = COLOURS[which % len(COLOURS)], MARKERS[which % len(MARKERS)]
        filled = colour if count == plays[-1] else "white"
        label = ", ".join((*rest, f"{count:,} plays"))
        handles.append(
            Line2D([], [], color=colour, marker=marker, markerfacecolor=filled, label=label)
        )
    figure.legend(
        handles=handles, title="bars: 95 % intervals", loc="outside upper center", ncols=2,
        frameon=False,
    )  # fmt: skip
