"""How the number of robots bears on success, time, memory and messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Scaling, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = ("robots", "agents", "messages", "team_bytes", "decision_median", "step_bytes")
"""What of whole trials the analysis rests on."""


def draw(analysis: Scaling) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"scaling": figure_of(analysis)} if analysis.points else {}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
