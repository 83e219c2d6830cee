"""Trained teams explained: rules and self-model, in words and figures."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ..explain import team
from ..explain.team import Explanation
from ..explain.text import draw, summarize, text
from ..store.store import Store
from ..trials.keeping import finished_trial

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class TeamExplanation:
    """Explanation of a trained team; printed, it is the summary of the command ``explain``."""

    explanation: Explanation = field(repr=False)
    """The explanation as numbers."""
    folder: Path
    """Folder in which the command writes it."""

    @property
    def text(self) -> str:
        """The whole explanation in words, with the rules of all agents."""
        return text(self.explanation)

    @property
    def figures(self) -> dict[str, Figure]:
        """Figures by name."""
        return draw(self.explanation)

    def __str__(self) -> str:
        return "\n".join(summarize(self.explanation))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def explain_team(
    directory: Path, condition: str | None = None, seed: int | None = None
) -> TeamExplanation:
    """Explain the team of a trial: the one that is kept, else it is trained again.

    Raises
    ------
    SpecError
        If there is no such trial, it has not finished, or its team has no rules; one line.
    """
    with Store.open(directory) as store:
        trial = finished_trial(store, condition, seed)
        folder = team.folder_of(directory, trial, list(store.columns()))
        return TeamExplanation(team.explain(store, trial), folder)
