"""What a failing wheel costs, and how a team comes back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import WheelFailures, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = ("onset",)
"""What of whole trials the analysis rests on."""


def draw(analysis: WheelFailures) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"wheel-failure": figure_of(analysis)} if analysis.courses else {}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
