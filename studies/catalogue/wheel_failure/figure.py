"""The figure of the wheel-failure study: success from episode to episode, fault by fault."""

from __future__ import annotations

from textwrap import wrap

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ...presentation.figures import COLOURS, SETTINGS, STYLES
from ...results.statistics import bootstrap
from .analysis import WheelFailures

SMOOTHED = 3
"""Episodes that a point of a curve averages over."""


def figure_of(analysis: WheelFailures) -> Figure:
    """Return the figure.

    A panel for every fault, a line for what adapts; running means over seeds and episodes, bands
    their 95 % intervals. Wheels fail at grey lines.
    """
    faults = list(dict.fromkeys(course.fault for course in analysis.courses))
    cases = list(dict.fromkeys(course.adapts for course in analysis.courses))
    columns = min(3, len(faults))
    rows = -(-len(faults) // columns)
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        size = (max(5.6, 1.0 + 2.6 * columns), 1.2 + 2.1 * rows)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes, fault in zip(panels.flat, faults, strict=False):
            for course in (c for c in analysis.courses if c.fault == fault):
                for onset in course.onsets:
                    axes.axvline(onset - 0.5, color="#888888", linewidth=0.8)
                index = cases.index(course.adapts)
                runs = _smoothed(course.success, course.onset)
                estimate = bootstrap(runs, bounds=(0, 1))
                episodes = np.arange(runs.shape[1])  # counted from 0, as in rows and specs
                colour, style = COLOURS[index % len(COLOURS)], STYLES[index % len(STYLES)]
                axes.fill_between(
                    episodes, estimate.low, estimate.high, color=colour, alpha=0.1, lw=0
                )
                axes.plot(episodes, estimate.value, color=colour, ls=style, lw=1.6)
            axes.set_title("\n".join(wrap(fault, round(60 / columns))), loc="left")
            axes.set_ylim(-0.03, 1.03)
            axes.grid(axis="y", alpha=0.25)
        for axes in list(panels.flat)[len(faults) :]:
            axes.set_visible(False)
        for axes in panels[:, 0]:
            axes.set_ylabel("success")
        for axes in list(panels.flat)[max(0, len(faults) - columns) : len(faults)]:
            axes.set_xlabel("episode")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            axes.tick_params(labelbottom=True)
        handles = [
            Line2D([], [], color=COLOURS[i], ls=STYLES[i % len(STYLES)], label=case)
            for i, case in enumerate(cases)
        ]
        seeds = sorted({len(course.success) for course in analysis.courses})
        counted = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
        figure.legend(
            handles=handles,
            title=f"what adapts\nmeans over {counted} seeds and {SMOOTHED} episodes, 95 % bands",
            loc="outside upper center",
            ncols=len(cases),
            frameon=False,
        )
        return figure


def _smoothed(success: np.ndarray, onset: int) -> np.ndarray:
    """Return means over the episode and those before it, but not across the onset."""
    means = [
        success[:, max(0 if e < onset else onset, e - SMOOTHED + 1) : e + 1].mean(axis=1)
        for e in range(success.shape[1])
    ]
    return np.stack(means, axis=1)
