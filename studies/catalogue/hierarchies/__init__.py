"""Which hierarchy it takes, at which size, at what cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..scaling.analysis import measure
from .analysis import Hierarchies, analyse, check

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = ("robots", "messages", "decision_median")
"""What of whole trials the analysis rests on."""


def draw(analysis: Hierarchies) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"hierarchies": figure_of(analysis)} if analysis.cases else {}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
