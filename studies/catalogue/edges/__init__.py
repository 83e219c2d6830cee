"""The edges study: what the edges of a hierarchy do, without training anew.

A team is trained in its condition's hierarchy, and then acts greedily, with the same weights and on
the same worlds, as every entry of ``[evaluations]`` has it: agents that are told nothing, that
consider nobody, that expect something else of the unseen, whose messages are lost. So a difference
is one of deciding alone, not of what was learned.

One measure was fixed beforehand: evaluation success. For each condition of training, every
evaluation is compared with that under the hierarchy of training, as in the study `hierarchies`.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ....core.agents.loop import StepRecord
from ....core.interface.scenario import groups_of
from ...errors import SpecError
from ...results.analysis import Analysis, Figures
from ...results.results import Results
from ...results.summary import EVALUATED
from ...spec.labels import label_but
from ...spec.spec import Spec
from ...trials.session import Session
from ...trials.trial import Trial, TrialResult
from ..hierarchies import HierarchyCase, analysis_of, estimates, sizes_of
from ..hierarchies import draw as draw_by_robots
from ..study import check_evaluated, check_rule_bases

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


def measure(trial: Trial) -> TrialResult:
    """Train a team, let it act under all hierarchies; imported by name in workers."""
    session = Session.compiled(trial)
    session.train(trial.episodes)
    deciding: dict[str, list[float]] = {n: [] for n in (TRAINED, *dict(trial.evaluations))}

    def note(name: str, record: StepRecord) -> None:
        deciding[name].append(record.deciding)

    session.evaluate(partial(note, TRAINED))
    session.run_other_evaluations({name: partial(note, name) for name in deciding})
    numbers = {"robots": float(len(groups_of(session.world)))}
    for name, settings in ((TRAINED, trial.settings), *trial.evaluations):
        numbers[f"messages.{name}"] = float(settings.arrange(session.world)[1].messages)
    usage = {f"decision.{name}": float(np.median(d)) for name, d in deciding.items()}
    return session.result(numbers, usage)


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95 % intervals, seeds as the unit of sampling."""
    cases, conditions = [], results.of_phase("evaluation")
    sizes = {c: int(results.numbers(c)["robots"][0]) for c in conditions}
    for condition, robots in sizes.items():
        numbers, columns = results.numbers(condition), results.columns.get(condition, {})
        value_of = label_but(columns, sizes_of(results.columns, sizes))
        for name, phase in ({TRAINED: "evaluation"} | results.other_evaluations(condition)).items():
            cost = numbers[f"decision.{name}"], numbers[f"messages.{name}"]
            values = estimates(results, condition, phase, *cost)
            cases.append(HierarchyCase(condition, name, value_of, robots, values, phase))
    return analysis_of(results, cases, TRAINED)


def draw(analysis: Analysis) -> Figures:
    """Return the figure of `hierarchies`; of one setting alone, differences from training."""
    from ...presentation import forest

    if len({case.setting for case in analysis.cases}) > 1:
        (by_robots,) = draw_by_robots(analysis).values()
        return {"edges": by_robots}
    figure = forest.draw({EVALUATED: analysis.differences}, f"success less that {TRAINED}")
    return {} if figure is None else {"edges": figure}


__all__ = ["analyse", "check", "draw", "measure"]
