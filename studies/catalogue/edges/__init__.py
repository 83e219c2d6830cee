"""The edges study: what the edges of a hierarchy do, without training anew.

A team is trained in its condition's hierarchy, and then acts greedily, with the same weights and on
the same worlds, as every entry of ``[evaluations]`` has it: agents that are told nothing, that
consider nobody, that expect something else of the unseen, whose messages are lost. So a difference
is one of deciding alone, not of what was learned.

One measure was fixed beforehand: evaluation success. Within each condition every evaluation is
compared with the hierarchy of training by permutation of signs; p is adjusted by Holm's method over
all of these comparisons. Decisions to the goal are those of successful episodes alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ....core.agents.loop import StepRecord
from ....core.interface.scenario import groups_of
from ...errors import SpecError
from ...results.analysis import Analysis
from ...results.comparison import Difference, adjusted, paired_difference
from ...results.paired_tests import LEVEL
from ...results.results import Results
from ...results.statistics import Estimate, bootstrap, rate
from ...results.summary import EVALUATED, Summary
from ...results.verdicts import power_lines
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..hierarchies import DECIDING, to_the_goal
from ..study import check_evaluated, check_rule_bases

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PUBLISHED = ("success",)
"""Measures of an episode that published results keep."""
TRAINED = "as trained"
"""How the hierarchy of training is called among the others."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated under other hierarchies."""
    check_evaluated(spec)
    check_rule_bases(spec, "who consider others and are told")
    if not spec.evaluations:
        raise SpecError(
            'evaluations: missing; edges needs one at least, as silent.topology.told = "none"'
        )


class _Deciding:
    """Collects how long decisions took."""

    def __init__(self) -> None:
        self.seconds: list[float] = []

    def __call__(self, record: StepRecord) -> None:
        self.seconds.append(record.deciding)


def measure(trial: Trial) -> TrialResult:
    """Train a team, let it act under all hierarchies; imported by name in workers."""
    session = Session.compiled(trial)
    session.train(trial.episodes)
    deciding = {name: _Deciding() for name in (TRAINED, *dict(trial.evaluations))}
    session.evaluate(deciding[TRAINED])
    session.run_other_evaluations(deciding)
    numbers = {"robots": float(len(groups_of(session.world)))}
    for name, settings in ((TRAINED, trial.settings), *trial.evaluations):
        _, hierarchy = settings.arrange(session.world)
        numbers[f"messages.{name}"] = float(hierarchy.messages)
    usage = {f"decision.{name}": float(np.median(d.seconds)) for name, d in deciding.items()}
    return session.result(numbers, usage)


@dataclass(frozen=True)
class Reevaluation:
    """A trained team under one hierarchy.

    Attributes
    ----------
    condition
        In which it was trained.
    name
        What the hierarchy is called.
    values
        Estimates by title.
    """

    condition: str
    name: str
    values: dict[str, Estimate]


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling.

    Cases are the differences by condition, p of no difference adjusted over all of them.
    """
    conditions = results.of_phase("evaluation")
    cases = [case for condition in conditions for case in _cases(results, condition)]
    alone = len(conditions) == 1
    table = [
        Summary(
            c.name if alone else f"{c.condition}, {c.name}",
            len(results.seeds(c.condition)),
            c.values,
        )
        for c in cases
    ]
    compared = _compared(results, conditions)
    every = [d for differences in compared.values() for d in differences]
    return Analysis(tuple(table), tuple(_notes(compared)), list(compared.items()), tuple(every))


def _phases(results: Results, condition: str) -> dict[str, str]:
    return {TRAINED: "evaluation"} | results.other_evaluations(condition)


def _cases(results: Results, condition: str) -> Iterator[Reevaluation]:
    numbers = results.numbers(condition)
    unknown = np.asarray(np.nan)  # a count has no interval
    for name, phase in _phases(results, condition).items():
        success = results.success(condition, phase)
        values = {EVALUATED: rate(success)}
        decisions = to_the_goal(success, results.values(condition, "steps", phase))
        if len(decisions):
            values["decisions to goal"] = bootstrap(decisions)
        values[DECIDING] = bootstrap(1e3 * numbers[f"decision.{name}"])
        values["messages"] = Estimate(numbers[f"messages.{name}"][0], unknown, unknown)
        yield Reevaluation(condition, name, values)


def _compared(results: Results, conditions: Sequence[str]) -> dict[str, tuple[Difference, ...]]:
    """Return by condition every evaluation less that of training, p adjusted over all."""
    made: list[tuple[str, Difference]] = []
    for condition in conditions:
        base = results.success(condition, "evaluation").mean(axis=1)
        for name, phase in results.other_evaluations(condition).items():
            own = results.success(condition, phase).mean(axis=1)
            if len(own) >= 2:
                estimate = paired_difference(own, base, of_rates=True)
                made.append((condition, Difference.of(name, EVALUATED, own, base, estimate)))
    every = zip([c for c, _ in made], adjusted([d for _, d in made]), strict=True)
    compared: dict[str, tuple[Difference, ...]] = {}
    for condition, difference in every:
        compared[condition] = (*compared.get(condition, ()), difference)
    return compared


def _notes(compared: dict[str, tuple[Difference, ...]]) -> Iterator[str]:
    """Yield what each hierarchy costs or gains against that of training."""
    every = [d for differences in compared.values() for d in differences]
    if not every:
        return
    yield f"\nEvaluation success less that {TRAINED}, p adjusted over {len(every)} comparisons:"
    for condition, differences in compared.items():
        if len(compared) > 1:
            yield f"{condition}:"
        for d in differences:
            verdict = "" if d.p < LEVEL else "; no difference found"
            yield f"  {d.condition}: {d.shown}{verdict}"
    yield from power_lines(every)


def draw(analysis: Analysis) -> dict[str, Figure]:
    """Return the figure: what every hierarchy costs or gains, a panel for each condition."""
    from ...presentation import forest

    figure = forest.draw(dict(analysis.cases), f"success less that {TRAINED}")
    return {} if figure is None else {"edges": figure}


__all__ = ["analyse", "check", "draw", "measure"]
