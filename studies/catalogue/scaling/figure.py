"""The figure of the scaling study: success, times, memory and messages by number of robots."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from ...presentation.figures import COLOURS, SETTINGS
from .analysis import Scaling

MARKERS = "osD^vP"
PANELS = (
    ("evaluation success", "evaluation success", False),
    ("decide [ms]", "deciding, per step [ms]", True),
    ("learn [ms]", "learning, per step [ms]", True),
    ("team [MB]", "arrays of the team [MB]", True),
    ("process [MB]", "process, peak [MB]", False),
)


def figure_of(analysis: Scaling) -> Figure:
    """Return the figure.

    Points are means over seeds, bars their 95 % intervals; evaluators differ by colour and marker,
    and stand a little beside each other.
    Messages are one black line if all evaluators pass as many.
    """
    evaluators = list(dict.fromkeys(p.evaluator for p in analysis.points))
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(8.4, 5.2), layout="constrained")
        panels = figure.subplots(2, 3, sharex=True)
        sizes = sorted({p.robots for p in analysis.points})
        for axes, (name, title, logarithmic) in zip(panels.flat, PANELS, strict=False):
            for index, evaluator in enumerate(evaluators):
                beside = 2.0 ** (0.06 * (index - (len(evaluators) - 1) / 2))
                _line(axes, analysis, evaluator, index, name, beside)
            axes.set_title(title, loc="left")
            if logarithmic:
                axes.set_yscale("log")
            else:
                top = 1.1 * axes.get_ylim()[1]
                axes.set_ylim(*((-0.03, 1.03) if name == "evaluation success" else (0.0, top)))
        for period in {p.period for p in analysis.points if p.period is not None}:
            panels[0][1].axhline(1e3 * period, color="#888888", linewidth=0.8, ls=":")
        _messages(panels[1][2], analysis, evaluators)
        for axes in panels.flat:
            axes.set_xscale("log", base=2)
            axes.set_xticks(sizes, [str(size) for size in sizes])
            axes.xaxis.set_minor_locator(NullLocator())
            axes.grid(alpha=0.25)
        for axes in panels[-1]:
            axes.set_xlabel("robots")
        handles = [
            Line2D(
                [], [], color=COLOURS[i % len(COLOURS)], marker=MARKERS[i % len(MARKERS)], label=e
            )
            for i, e in enumerate(evaluators)
        ]
        title = "means over seeds, bars: 95 % intervals; dotted: the decision period"
        figure.legend(
            handles=handles, title=title, loc="outside upper center", ncols=4, frameon=False
        )
        return figure


def _messages(axes: Axes, analysis: Scaling, evaluators: list[str]) -> None:
    """Draw a black line if all evaluators agree, as one topology's do, else a line of each."""
    counts = {(p.robots, p.messages) for p in analysis.points}
    if len(counts) == len({robots for robots, _ in counts}):
        axes.plot(*zip(*sorted(counts), strict=True), "k.-", linewidth=1.2)
    else:
        for index, evaluator in enumerate(evaluators):
            own = sorted(
                (p.robots, p.messages) for p in analysis.points if p.evaluator == evaluator
            )
            axes.plot(*zip(*own, strict=True), **_style(index))
    if min(passed for _, passed in counts):
        axes.set_yscale("log")
    else:  # agents that see nobody pass nothing
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(bottom=-0.2)
    axes.set_title("messages passed down, per step", loc="left")


def _line(
    axes: Axes, analysis: Scaling, evaluator: str, index: int, name: str, beside: float
) -> None:
    """Draw an evaluator's points, `beside` times to the right of their numbers of robots."""
    own = [p for p in analysis.points if p.evaluator == evaluator and name in p.values]
    if not own:
        return
    robots = [p.robots * beside for p in own]
    value, low, high = np.array(
        [[float(getattr(p.values[name], end)) for p in own] for end in ("value", "low", "high")]
    )
    style = _style(index)
    axes.vlines(robots, low, high, color=style["color"], linewidth=1.2)
    axes.plot(robots, value, **style)


def _style(index: int) -> dict[str, Any]:
    """Return how the line of an evaluator looks."""
    return {
        "color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)],
        "markersize": 4, "linewidth": 1.2,
    }  # fmt: skip
