"""What each ingredient of the default contributes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...trials.session import run_trial as measure
from .analysis import PHASES, Ablation, analyse

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(analysis: Ablation) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from ...presentation.forest import Panel
    from ...presentation.forest import draw as forest

    panels = [
        Panel(f"success {title}", [d for d in analysis.differences if d.measure == title])
        for title in PHASES
    ]
    figure = forest(panels, "difference from the first condition")
    return {} if figure is None else {"ablation": figure}


__all__ = ["analyse", "draw", "measure"]
