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
    pairs = [(team, control_of(team, there)) for team in teams]
    return tuple(
        _sentence(results, team, control, there)
        for team, control in pairs
        if control is not None
        and all(results.has(c, "evaluation", results.main.name) for c in (team, control))
    )


def below_random(results: Results, settings: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Return a remark, in lines, on learners that end below the random control of their scenario.

    The comparison uses the means of `Results.main`.
    """
    main = results.main
    known = {
        c: settings[c]
        for c in results.of_phase("evaluation")
        if c in settings and results.has(c, "evaluation", main.name)
    }
    sign = -1.0 if main.better == "lower" else 1.0
    means = {c: sign * results.means(c, "evaluation", main.name).mean() for c in known}
    learners = [c for c, own in known.items() if own["learner"]["kind"] not in LEARN_NOTHING]
    controls = {c: random_control(c, known) for c in learners}
    below = {c: other for c, other in controls.items() if other and means[c] < means[other]}
    if not below:
        return ()
    shown = [f"{c} {_evaluated(results, c)}" for c in [*below][:MOST]]
    shown += [f"{len(below) - MOST} more"] * (len(below) > MOST)
    shown += [f"{c} {_evaluated(results, c)}" for c in dict.fromkeys(below.values())]
    text = f"Below random actions in evaluation {main.heading}: {'; '.join(shown)}. "
    return tuple(wrapped(f"{text}What to try: {TROUBLESHOOTING}"))


def _sentence(
    results: Results, team: str, control: str, settings: Mapping[str, Mapping[str, Any]]
) -> str:
    """Return what is said of a team that learns, and of its controls."""
    compared = compare_conditions(results, results.main.name, "evaluation", reference=team)
    less = {d.condition: d for d in compared.differences}
    counted = count(len(results.seeds(team)), "seed")
    is_learned = control in less and _compared(less[control]) == "worse"
    verdict = f"learned ({counted})" if is_learned else f"is not seen to learn with {counted}"
    parts = [f"untrained ({control}) {_evaluated(results, control)}"]
    for other, own in settings.items():
        is_control = own["learner"]["kind"] in LEARN_NOTHING and other != control
        if is_control and other in less and not is_drawn(own):
            word = _compared(less[other]) or f"difference not decided with {counted}"
            parts.append(f"{other} {_evaluated(results, other)}, {word}")
    title = f"evaluation {results.main.heading}"
    return f"{team} {verdict}: {title} {_evaluated(results, team)}; {'; '.join(parts)}."


def _evaluated(results: Results, condition: str) -> str:
    return format_estimate(estimate_of(results, condition, "evaluation", results.main))


def _compared(difference: Difference) -> str:
    """Return whether a control does significantly worse or better than the team."""
    if difference.p >= LEVEL:
        return ""
    return "worse" if difference.estimate.value < 0.0 else "better"
