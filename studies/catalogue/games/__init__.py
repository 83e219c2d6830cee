"""What nesting buys in repeated games, and what it does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Games, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: Games) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"games": figure_of(analysis)} if analysis.cases else {}


__all__ = ["analyse", "check", "draw", "measure"]
