"""Whether it matters who is above whom in a chain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...trials.session import run_trial as measure
from .analysis import ChainOrders, analyse

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: ChainOrders) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"chain-order": figure_of(analysis)} if analysis.comparisons else {}


__all__ = ["analyse", "draw", "measure"]
