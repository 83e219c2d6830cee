"""The figure of laws of growth: what was measured, the law, and what it predicts."""

from contextlib import suppress

import numpy as np
from matplotlib.figure import Figure

from ..errors import SpecError
from ..laws.fitting import Law
from ..laws.samples import LOGIT
from ..laws.scaling import ScalingLaw, scaling_law
from ..results.results import Results
from . import figures

POINTS = 60
"""Points of a curve."""
BEYOND = 2.0
"""Factor by which a curve extends beyond the largest size if no size is predicted."""

REPORTED = {"success": "growth of success", "decision_median": "growth of the time of a decision"}
"""Names of the figures of laws in a report, by measure."""


def growth_figures(results: Results) -> dict[str, Figure]:
    """Return the laws of a study that sweeps a size, one figure a measure, as far as there are."""
    drawn = {}
    for measure, name in REPORTED.items():
        with suppress(SpecError):
            analysis = scaling_law(results, measure)
            if any(fitted.law is not None for fitted in analysis.fits):
                drawn[name] = draw_laws(analysis)
    return drawn


def draw_laws(analysis: ScalingLaw) -> Figure:
    """Return the figure: seeds are points, lines laws, bands 90% predictions of their mean.

    Sizes that were not run are left of the band's end beyond the dotted line.
    """
    known = [(f.group or analysis.title, f.law) for f in analysis.fits if f.law is not None]
    figure, panels = figures.panels(1, 1, (5.4, 3.6))
    axes = panels[0, 0]
    sizes = sorted({float(n) for _, law in known for n in law.sample.sizes})
    last = max([BEYOND * sizes[-1], *analysis.predicted]) if sizes else 1.0
    for index, (_, law) in enumerate(known):
        _draw(figure, index, law, last)
    if known:
        is_rate = known[0][1].sample.scale is LOGIT
        figures.scale_axis(axes, [round(n) for n in (*sizes, last)])
        if is_rate:
            figures.as_rates(axes)
        else:
            figures.log_axis(axes)
        axes.axvline(sizes[-1], color="#888888", linewidth=0.8, ls=":")
        figures.name_lines(figure, [group for group, _ in known], "bands: 90% of new means")
    axes.set_title(analysis.title, loc="left")
    axes.set_xlabel(analysis.size)
    return figure


def _draw(figure: Figure, index: int, law: Law, last: float) -> None:
    (axes,) = figure.axes
    color = figures.look(index)["color"]
    measured = law.sample.observed
    places = np.broadcast_to(law.sample.sizes, measured.shape)
    axes.scatter(places, measured, s=6, alpha=0.35, color=color, linewidths=0)
    line = np.geomspace(law.sample.sizes[0], last, POINTS)
    predicted = [law.predict(float(n)) for n in line]
    axes.plot(line, law.curve_at(line), color=color, lw=1.4)
    low = [float(e.low) for e in predicted]
    high = [float(e.high) for e in predicted]
    axes.fill_between(line, low, high, color=color, alpha=0.15, linewidth=0)
