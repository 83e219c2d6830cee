"""The figure of laws of growth: what was measured, the law, and what it predicts."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..laws.fitting import Law
from ..laws.samples import LOGIT
from ..laws.scaling import ScalingLaw
from ..results.statistics import stack_estimates
from . import figures

POINTS = 60
"""Points of a curve."""
MARGIN = 2.0
"""Factor by which a logarithmic axis extends beyond what was measured and the laws."""
BEYOND = 2.0
"""Factor by which a curve extends beyond the largest size if no size is predicted."""


def draw_laws(analysis: ScalingLaw) -> Figure:
    """Return the figure: seeds are points, lines laws, bands 90% predictions of their mean.

    The axis shows what was measured and the laws, even if a band extends further.
    """
    known = [(group or analysis.title, law) for group, law in analysis.laws.items()]
    sizes = sorted({float(n) for _, law in known for n in law.sample.sizes})
    last = max([BEYOND * sizes[-1], *analysis.predicted]) if sizes else 1.0
    with figures.apply_style():
        figure, panels = figures.panels(1, 1, (5.0, 3.8))
        axes = panels[0, 0]
        for index, (_, law) in enumerate(known):
            _draw(axes, law, index, len(known), last)
        if known:
            figures.scale_axis(axes, [round(n) for n in (*sizes, last)])
            _limit(axes, [law for _, law in known], last)
            largest = {"color": "#555555", "lw": 1.0, "ls": ":"}
            axes.axvline(sizes[-1], **largest)
            entry = figures.handle("largest size that was run", **largest)
            title = "points: seeds; lines: laws; bands: 90% predictions of a mean"
            figures.name_lines(figure, [group for group, _ in known], title, [entry])
        axes.set_title(analysis.title, loc="left")
        axes.set_xlabel(analysis.size)
    return figures.spell_dollars(figure, [group for group, _ in known])


def _draw(axes: Axes, law: Law, index: int, lines: int, last: float) -> None:
    """Draw what was measured in one group, its law, and the predictions of the law."""
    sample = law.sample
    places = figures.beside_each_other(sample.sizes, index, lines)
    color = figures.look(index)["color"]
    axes.scatter(
        np.broadcast_to(places, sample.observed.shape), sample.observed, s=24, alpha=0.8,
        marker=figures.marker(index), color=color, edgecolor="white", linewidths=0.6, zorder=3,
    )  # fmt: skip
    line = np.geomspace(sample.sizes[0], last, POINTS)
    predicted = stack_estimates([law.predict(float(n)) for n in line])
    figures.draw_curve(axes, line, predicted._replace(value=law.curve_at(line)), index)


def _limit(axes: Axes, laws: Sequence[Law], last: float) -> None:
    """Scale the vertical axis to what was measured and to the laws."""
    if laws[0].sample.scale is LOGIT:
        figures.as_rates(axes)
        return
    shown = [law.sample.observed for law in laws] + [law.curve_at(np.array([last])) for law in laws]
    values = np.concatenate([array.ravel() for array in shown])
    positive = values[values > 0.0]
    if positive.size:
        axes.set_ylim(positive.min() / MARGIN, positive.max() * MARGIN)
    figures.log_axis(axes)
