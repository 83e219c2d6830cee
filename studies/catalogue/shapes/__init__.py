"""Whether the shape of the box is indifferent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Shapes, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: Shapes) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from ...presentation.forest import Panel
    from ...presentation.forest import draw as forest

    panels = [Panel(condition, found, null=1.0) for condition, found in analysis.ratios.items()]
    figure = forest(panels, "success over that with the box of training")
    return {} if figure is None else {"shapes": figure}


__all__ = ["analyse", "check", "draw", "measure"]
