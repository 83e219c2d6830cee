"""Ours beside learners of other libraries: success against experience and against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .analysis import Peers, analyse, check, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: Peers) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"peers": figure_of(analysis)} if analysis.courses else {}


__all__ = ["analyse", "check", "draw", "measure"]
