"""The figure of the statistics of the field: performance profiles and sample efficiency."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..results.aggregates import Aggregates

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(aggregates: Aggregates) -> Figure:
    """Return the figure: share of runs above each score, interquartile mean by episode."""
    from . import figures as f  # matplotlib takes its time

    names = [line.condition for line in aggregates.table]
    with f.styled():
        figure, axes = f.panels(1, 1 + bool(aggregates.curves), (7.2, 2.9))
        profiles, *efficiency = axes[0]
        for index, profile in enumerate(aggregates.profiles.values()):
            f.draw_curve(profiles, aggregates.thresholds, profile, index)
        profiles.set(xlabel=f"score: {aggregates.title}", title="share of runs that score more")
        f.as_rates(profiles)
        for own in efficiency:
            for index, curve in enumerate(aggregates.curves.values()):
                f.draw_curve(own, range(len(curve.value)), curve, index)
            own.set(title="interquartile mean, training")
            f.as_episodes(own)
        handles = [f.handle(name, **f.look(i), lw=1.6) for i, name in enumerate(names)]
        f.add_legend(figure, handles, ncols=max(1, 90 // (max(map(len, names)) + 8)))
    return figure
