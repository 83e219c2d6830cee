"""How the agents fare from episode to episode."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...trials.session import run_trial as measure
from .analysis import LearningCurves, analyse

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: LearningCurves) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"learning-curves": figure_of(analysis)} if analysis.table else {}


__all__ = ["analyse", "draw", "measure"]
