"""The nested agents beside the systems that the paper measures itself against (Section X)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Related, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = ("agents", "memory", "messages", "formula", "counted")
"""What of whole trials the analysis rests on."""


def draw(analysis: Related) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"related": figure_of(analysis)} if analysis.cases else {}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
