"""Figures of an explanation: functions of one variable, and the policy."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from ..presentation import figures
from ..presentation.figures import add_legend, look, marker
from .rules import exponent, percent
from .team import Explanation

MOST_LINES = 8
"""Agents in one figure of functions."""


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


def _functions(explained: Explanation, block: slice) -> Figure:
    d = len(explained.variables)
    figure, panels = figures.grid(d, 4, (2.45, 2.2), (0.0, 0.7), sharey=True)
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
    scale = rf" [$\times 10^{{{-power}}}$]" if power else ""
    figure.supylabel(f"adds to f{scale}", fontsize=9)
    title = "markers: rules, less their mean; in the titles the share of the variance of f"
    add_legend(figure, panels[0].get_lines()[: len(names)], title)
    return figure
