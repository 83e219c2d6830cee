"""Nested agents beside the single agent: the table and the figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...topologies.view import aligned
from ..analysis.statistics import Estimate
from ..analysis.summary import interval, two_figures
from ..presentation.figures import COLOURS, SETTINGS, write
from .single_agent import BLOCK, CONTENDERS, Contest
from .table import scientific


def table(contests: Sequence[Contest]) -> str:
    """Return the table for printing."""
    rows = [["n", "", "step", "last 20", "greedy", "weights", "formula", "counted", "ms"]]
    for c in contests:
        rows.append(
            [
                str(c.agents),
                c.contender,
                "-" if c.contender == CONTENDERS[2] else f"{c.step_size:g}",
                _rate(c.last),
                _rate(c.greedy),
                scientific(c.weights),
                scientific(c.formula),
                scientific(round(c.rule_evaluations)),
                f"{1e3 * c.seconds:.2f}",
            ]
        )
    return "\n".join(
        [
            *aligned(rows, "><>>>>>>>"),
            "",
            f"Line-up, {len(contests[0].curves)} seeds. last {BLOCK}, greedy: success with its",
            "95 % interval; step: step size, chosen on other seeds; formula: operations per",
            "iteration, Eq. 18 and 23; counted: rule evaluations per step; ms: per step.",
        ]
    )


def draw(contests: Sequence[Contest], path: Path) -> None:
    """Write the learning curves and the time of a step: SVG, PNG or PDF by suffix.

    Curves are means over seeds, smoothed over 10 episodes.
    """
    agents = list(dict.fromkeys(c.agents for c in contests))
    with mpl.rc_context(SETTINGS):  # type: ignore[arg-type]
        columns = len(agents) + 1
        figure = Figure(figsize=(2.4 * columns + 0.6, 3.2), layout="constrained")
        panels = figure.subplots(1, columns, squeeze=False)[0]
        for axes, n in zip(panels, agents, strict=False):
            for c in (c for c in contests if c.agents == n):
                curve = np.convolve(c.curves.mean(axis=0), np.ones(10) / 10, mode="valid")
                colour = COLOURS[CONTENDERS.index(c.contender)]
                axes.plot(np.arange(len(curve)) + 10, curve, color=colour)
            axes.set_ylim(-0.03, 1.03)
            axes.set_title(f"success, n = {n}", loc="left")
            axes.set_xlabel("episode")
        axes = panels[-1]
        for i, contender in enumerate(CONTENDERS[:2]):
            own = [c for c in contests if c.contender == contender]
            axes.semilogy(
                [c.agents for c in own], [1e3 * c.seconds for c in own], "o-", color=COLOURS[i]
            )
        axes.set_xticks(agents)
        axes.set_xlabel("agents n")
        axes.set_title("time of a step [ms]", loc="left")
        for axes in panels:
            axes.grid(alpha=0.25)
        handles = [Line2D([], [], color=COLOURS[i], label=c) for i, c in enumerate(CONTENDERS)]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
        write(figure, path)


def _rate(estimate: Estimate) -> str:
    return f"{two_figures(float(estimate.value))} [{interval(estimate)}]"
