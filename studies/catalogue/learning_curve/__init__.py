"""How the agents fare from episode to episode."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...spec.errors import SpecError
from .analysis import LearningCurves, analyse

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...spec.spec import Spec
    from ...trials.trial import Trial, TrialResult


def check(spec: Spec) -> None:
    """Raise `SpecError` if something is to fail after the last episode of training."""
    for condition in spec.conditions():
        for failure in getattr(condition.settings.scenario, "failures", ()):
            if failure.episode >= spec.episodes:
                raise SpecError(
                    f"scenario.failures: one begins in episode {failure.episode}, allowed 0 to "
                    f"{spec.episodes - 1} of {spec.episodes} episodes "
                    f"(condition {condition.label!r})"
                )


def measure(trial: Trial) -> TrialResult:
    """Run a trial."""
    from ...trials.session import run_trial  # who only reads results needs nothing that learns

    return run_trial(trial)


def draw(analysis: LearningCurves) -> dict[str, Figure]:
    """Return the figures of an analysis by name."""
    from .figure import figure_of  # workers import this package, and matplotlib takes its time

    return {"learning-curves": figure_of(analysis)} if analysis.table else {}


__all__ = ["analyse", "check", "draw", "measure"]
