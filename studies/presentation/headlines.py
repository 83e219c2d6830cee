"""A sentence for each learning team: whether it learned, compared with its controls."""

from collections.abc import Mapping
from typing import Any

from ..results.analysis import estimate_of
from ..results.comparison import compare_conditions
from ..results.differences import Difference
from ..results.notation import format_estimate, wrapped
from ..results.permutation_tests import LEVEL
from ..results.results import Results
from ..spec.controls import (
    LEARN_NOTHING,
    TROUBLESHOOTING,
    control_of,
    is_drawn,
    random_control,
)
from .progress import count

MOST = 3
"""Largest number of learning teams that have sentences; more are left to the tables."""


def headlines(results: Results, settings: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Return sentences on what the teams of a study have learned, by evaluation.

    They are judged by `Results.main`. A team has learned if it is significantly better than the
    control that differs from it in learning alone, p adjusted over all conditions. None of teams
    without such a control.

    Parameters
    ----------
    results
        Of a study.
    settings
        Of its conditions, by label.
    """
    there = {c: settings[c] for c in results.conditions if c in settings}
    teams = [c for c, own in there.items() if own["learner"]["kind"] not in LEARN_NOTHING]
    if not 1 <= len(teams) <= MOST:
        return ()
    sentences: list[str] = []
    main = results.main.name
    for team in teams:
        control = control_of(team, there)
        measured = [c for c in (team, control) if c and results.has(c, "evaluation", main)]
        if len(measured) == 2:
            sentences.append(_sentence(results, team, measured[1], there))
    return tuple(sentences)


def below_random(results: Results, settings: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Return a remark, in lines, on learners that end below the random control of their scenario.

    The comparison uses the means of `Results.main`.
    """
    main = results.main
    there = {c: settings[c] for c in results.of_phase("evaluation") if c in settings}
    known = {c: own for c, own in there.items() if results.has(c, "evaluation", main.name)}
    sign = -1.0 if main.better == "lower" else 1.0
    below: dict[str, str] = {}
    for condition, own in known.items():
        control = random_control(condition, known)
        if own["learner"]["kind"] not in LEARN_NOTHING and control is not None:
            means = [results.means(c, "evaluation", main.name).mean() for c in (condition, control)]
            if sign * (means[0] - means[1]) < 0.0:
                below[condition] = control
    if not below:
        return ()
    shown = [f"{c} {_evaluated(results, c)}" for c in [*below][:MOST]]
    if len(below) > MOST:
        shown.append(f"{len(below) - MOST} more")
    controls = [f"{c} {_evaluated(results, c)}" for c in dict.fromkeys(below.values())]
    text = f"Below random actions in evaluation {main.heading}: {'; '.join(shown)}; "
    return tuple(wrapped(f"{text}{'; '.join(controls)}. What to try: {TROUBLESHOOTING}"))


def _sentence(
    results: Results, team: str, control: str, settings: Mapping[str, Mapping[str, Any]]
) -> str:
    """Return what is said of a team that learns, and of its controls."""
    compared = compare_conditions(results, results.main.name, "evaluation", reference=team)
    less = {d.condition: d for d in compared.differences}
    counted = count(len(results.seeds(team)), "seed")
    is_learned = control in less and _is_below(less[control])
    verdict = f"learned ({counted})" if is_learned else f"is not seen to learn with {counted}"
    parts = [f"untrained ({control}) {_evaluated(results, control)}"]
    for other, own in settings.items():
        is_control = own["learner"]["kind"] in LEARN_NOTHING and other != control
        if is_control and other in less and not is_drawn(own):
            parts.append(f"{other} {_evaluated(results, other)}, {_beside(less[other], counted)}")
    title = f"evaluation {results.main.heading}"
    return f"{team} {verdict}: {title} {_evaluated(results, team)}; {'; '.join(parts)}."


def _evaluated(results: Results, condition: str) -> str:
    return format_estimate(estimate_of(results, condition, "evaluation", results.main))


def _is_below(difference: Difference) -> bool:
    return difference.p < LEVEL and bool(difference.estimate.value < 0.0)


def _beside(difference: Difference, counted: str) -> str:
    """Return how a control differs from the team, in a few words."""
    if difference.p >= LEVEL:
        return f"difference not decided with {counted}"
    return "worse" if difference.estimate.value < 0.0 else "better"
