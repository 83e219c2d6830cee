"""The figure of the hierarchies study: success and time of a decision by number of robots."""

from __future__ import annotations

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ...presentation.by_robots import add_legend, draw_line, scale_axis
from ...presentation.figures import SETTINGS, log_axis
from ...results.summary import EVALUATED
from .analysis import DECIDING, Hierarchies

ROWS = (EVALUATED, DECIDING)
"""What is shown above and below."""


def figure_of(analysis: Hierarchies) -> Figure:
    """Return the figure: a column of panels for each choice of whose value decides.

    Points are means over seeds, bars their 95 % intervals; hierarchies differ by colour and marker,
    and stand a little beside each other.
    """
    cases = analysis.cases
    hierarchies = list(dict.fromkeys(case.hierarchy for case in cases))
    whose = list(dict.fromkeys(case.value_of for case in cases))
    sizes = sorted({case.robots for case in cases})
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(max(5.6, 0.6 + 2.8 * len(whose)), 5.2), layout="constrained")
        panels = figure.subplots(2, len(whose), sharex=True, sharey="row", squeeze=False)
        for column, value_of in zip(panels.T, whose, strict=True):
            for index, hierarchy in enumerate(hierarchies):
                own = [c for c in cases if (c.hierarchy, c.value_of) == (hierarchy, value_of)]
                for axes, title in zip(column, ROWS, strict=True):
                    robots, values = [c.robots for c in own], [c.values[title] for c in own]
                    draw_line(axes, robots, values, index, len(hierarchies))
            column[0].set_title(f"value of: {value_of}" if value_of else "", loc="left")
            column[1].set_xlabel("robots")
        for axes in panels.flat:
            scale_axis(axes, sizes)
        panels[0][0].set_ylim(-0.03, 1.03)
        log_axis(panels[1][0])
        panels[1][0].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panels[1][0].yaxis.set_major_formatter("{x:g}")
        panels[1][0].yaxis.set_minor_formatter("")
        for axes, title in zip(panels[:, 0], (EVALUATED, "deciding [ms]"), strict=True):
            axes.set_ylabel(title)
        add_legend(figure, hierarchies, "means over seeds, bars: 95 % intervals")
        return figure
