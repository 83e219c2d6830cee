"""Trained teams of a study, evaluated with lost agents or actuators."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from numbers import Integral, Real

from ...core.plugins.words import expect
from ..errors import SpecError, refused
from ..resilience.analysis import Resilience, TeamLosses
from ..resilience.losses import losable_team, loss_sets, next_number, with_loss
from ..resilience.report import ResilienceReport
from ..results.measured import title_of, values_by_seed
from ..results.results import Results
from ..store.database import EVALUATION
from ..trials.trial import Trial
from .kept_teams import KeptTeams


def measure_resilience(
    results: Results,
    kept: KeptTeams,
    evaluate: Callable[[Sequence[Trial], str], Results],
    *,
    fault: str,
    measure: str | None,
    max_sets: int,
    tolerance: float,
) -> ResilienceReport:
    """Evaluate the kept teams of a study with losses; see `StudyResults.resilience`."""
    expect("a whole number", Integral, sets=max_sets)
    if max_sets < 1:
        raise SpecError(f"sets = {max_sets}: must be 1 or more")
    expect("a share", Real, tolerance=tolerance)
    if not 0.0 < tolerance < 1.0:
        raise SpecError(f"tolerance = {tolerance:g}: must be above 0 and below 1")
    name = results.main.name if measure is None else measure
    shown_as, values, phase = values_by_seed(results, name, "evaluation")
    if not phase or shown_as.better == "lower":
        raise SpecError(f"measure = {name!r}: must be a measure of episodes, higher being better")
    title = title_of(shown_as, phase)
    settings = {trial.condition: trial.settings for trial in kept.trials}
    with kept.spec.sources.active(), refused():
        teams = [
            TeamLosses(condition, *losable_team(own, fault), values[condition])
            for condition, own in settings.items()
        ]
        able = tuple(own for own in teams if own.intact_mean > 0.0)
        if not able:
            raise SpecError(f"{title} of all intact teams is 0 or below")
        n_lost = 1
        while open_teams := [
            own for own in able if own.halving is None and n_lost < len(own.units)
        ]:
            sets = [loss_sets(len(own.units), n_lost, max_sets) for own in open_teams]
            losses = {}
            for own, lost in zip(open_teams, sets, strict=True):
                named = ([own.units[i] for i in units] for units in lost)
                each = (with_loss(settings[own.condition], fault, units) for units in named)
                losses[own.condition] = tuple((str(k), other) for k, other in enumerate(each))
            open_trials = (trial for trial in kept.trials if trial.condition in losses)
            evaluated = evaluate(
                [replace(trial, evaluations=losses[trial.condition]) for trial in open_trials],
                f"{n_lost} lost: up to {max(map(len, sets))} evaluations of each trained team",
            )
            for own, lost in zip(open_teams, sets, strict=True):
                for k, units in enumerate(lost):
                    entry = f"{EVALUATION}{k}"
                    own.lost[units] = evaluated.by_seed(own.condition, entry, shown_as.name)
            n_lost = next_number(n_lost)
    left_out = tuple(own.condition for own in teams if own.intact_mean <= 0.0)
    return ResilienceReport(Resilience(fault, shown_as, title, tolerance, able, left_out))
