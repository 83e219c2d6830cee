"""The figure of the scaling study: success, times, memory and messages by number of robots."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...presentation.by_robots import add_legend, draw_line, scale_axis, style
from ...presentation.figures import SETTINGS, log_axis
from .analysis import Scaling

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
                own = [p for p in analysis.points if p.evaluator == evaluator and name in p.values]
                if own:
                    robots, values = [p.robots for p in own], [p.values[name] for p in own]
                    draw_line(axes, robots, values, index, len(evaluators))
            axes.set_title(title, loc="left")
            if logarithmic:
                log_axis(axes)
            else:
                top = 1.1 * axes.get_ylim()[1]
                axes.set_ylim(*((-0.03, 1.03) if name == "evaluation success" else (0.0, top)))
        for period in {p.period for p in analysis.points if p.period is not None}:
            panels[0][1].axhline(1e3 * period, color="#888888", linewidth=0.8, ls=":")
        _messages(panels[1][2], analysis, evaluators)
        for axes in panels.flat:
            scale_axis(axes, sizes)
        for axes in panels[-1]:
            axes.set_xlabel(analysis.bodies)
        title = "means over seeds, bars: 95 % intervals; dotted: the decision period"
        add_legend(figure, evaluators, title)
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
            axes.plot(*zip(*own, strict=True), **style(index))
    if min(passed for _, passed in counts):
        log_axis(axes)
    else:  # agents that see nobody pass nothing
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(bottom=-0.2)
    axes.set_title("messages passed down, per step", loc="left")
