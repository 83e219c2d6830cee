"""A sentence for each team that learns: whether it has learned, and beside what."""

from collections.abc import Mapping
from textwrap import wrap
from typing import Any

from ...core.interface.measures import SUCCESS
from ..errors import WIDTH
from ..results.analysis import EVALUATED, Difference, format_p
from ..results.contrasts import contrasts
from ..results.notation import bracketed
from ..results.results import Results
from ..results.statistics import LEVEL, rate
from ..spec.controls import LEARN_NOTHING, control_of, is_drawn

MOST = 3
"""Teams that learn of which sentences are made; of more, tables and verdicts tell."""


def headlines(results: Results, settings: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Return lines that say what the teams of a study have learned, by success in evaluation.

    A team has learned if it is significantly better than the control that differs from it in
    learning alone, p adjusted over all conditions. None of teams without such a control.

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
    lines: list[str] = []
    for team in teams:
        control = control_of(team, there)
        measured = [c for c in (team, control) if c and results.has(c, "evaluation", SUCCESS.name)]
        if len(measured) == 2:
            text = _sentence(results, team, measured[1], there)
            lines += wrap(text, WIDTH, subsequent_indent="  ", break_on_hyphens=False)
    return tuple(lines)


def _sentence(
    results: Results, team: str, control: str, settings: Mapping[str, Mapping[str, Any]]
) -> str:
    """Return what is said of a team that learns, and of its controls."""
    compared = contrasts(results, phase="evaluation", reference=team)
    less = {d.condition: d for d in compared.differences}
    is_learned = control in less and _is_below(less[control])
    verdict = "learned" if is_learned else "not seen to learn"
    tested = f" (p {format_p(less[control].p)})" if control in less else ""
    parts = [f"untrained ({control}) {_success(results, control)}{tested}"]
    for other, own in settings.items():
        is_control = own["learner"]["kind"] in LEARN_NOTHING and other != control
        if is_control and other in less and not is_drawn(own):
            parts.append(f"{other} {_success(results, other)}, {_beside(less[other])}")
    seeds = len(results.seeds(team))
    counted = f"{seeds} seed{'s' * (seeds != 1)}"
    whole = f"{EVALUATED} {_success(results, team)}; {'; '.join(parts)}"
    return f"{team}: {verdict} ({counted}). {whole[0].upper()}{whole[1:]}."


def _success(results: Results, condition: str) -> str:
    return bracketed(rate(results.success(condition, "evaluation")))


def _is_below(difference: Difference) -> bool:
    return difference.p < LEVEL and bool(difference.estimate.value < 0.0)


def _beside(difference: Difference) -> str:
    """Return how a control differs from the team, in a few words."""
    if difference.p >= LEVEL:
        return "no significant difference"
    return "worse" if difference.estimate.value < 0.0 else "better"
