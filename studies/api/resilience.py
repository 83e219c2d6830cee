"""Trained teams of a study, evaluated with lost agents or actuators."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..errors import SpecError, refused
from ..resilience.analysis import Resilience, TeamLosses
from ..resilience.losses import losable_team, loss_sets, next_number, with_loss
from ..resilience.report import ResilienceReport
from ..results.comparison import title_of, values_by_seed
from ..results.results import Results
from ..spec.conditions import ConditionSettings
from ..store.database import EVALUATION
from ..trials.trial import Trial
from .kept_teams import KeptTeams


def measure_resilience(
    results: Results,
    kept: KeptTeams,
    evaluate: Callable[[Sequence[Trial]], Results],
    *,
    fault: str,
    measure: str | None,
    max_sets: int,
    tolerance: float,
) -> ResilienceReport:
    """Evaluate the kept teams of a study with losses; see `StudyResults.resilience`."""
    if max_sets < 1:
        raise SpecError(f"sets = {max_sets}: must be 1 or more")
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
            sets = {
                own.condition: loss_sets(len(own.units), n_lost, max_sets) for own in open_teams
            }
            losses = {
                own.condition: [[own.units[i] for i in units] for units in sets[own.condition]]
                for own in open_teams
            }
            evaluated = evaluate(_trials_with_losses(kept, fault, losses))
            for own in open_teams:
                for k, units in enumerate(sets[own.condition]):
                    entry = f"{EVALUATION}{k}"
                    own.lost[units] = evaluated.by_seed(own.condition, entry, shown_as.name)
            n_lost = next_number(n_lost)
    left_out = tuple(own.condition for own in teams if own.intact_mean <= 0.0)
    return ResilienceReport(Resilience(fault, shown_as, title, tolerance, able, left_out))


def _trials_with_losses(
    kept: KeptTeams, fault: str, losses: Mapping[str, Sequence[Sequence[str]]]
) -> list[Trial]:
    """Return the trials of conditions, each with a further evaluation for every set of units."""
    evaluations: dict[str, tuple[tuple[str, ConditionSettings], ...]] = {}
    trials = []
    for trial in kept.trials:
        label = trial.condition
        if label in losses:
            if label not in evaluations:
                evaluations[label] = tuple(
                    (str(k), with_loss(trial.settings, fault, units))
                    for k, units in enumerate(losses[label])
                )
            trials.append(replace(trial, evaluations=evaluations[label]))
    return trials
