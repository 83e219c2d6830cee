"""What nested agents and a single agent learn beside what they cost (Section VII)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Contests, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = ("agents", "weights", "formula", "rule_evaluations")
"""What of whole trials the analysis rests on."""


def draw(analysis: Contests) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"single-agent": figure_of(analysis)} if analysis.contests else {}


__all__ = ["NUMBERS", "analyse", "check", "draw", "measure"]
