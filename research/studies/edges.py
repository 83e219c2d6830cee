"""The edges study: what the edges of a hierarchy do, without training anew.

A team is trained in its condition's hierarchy, and then acts greedily, with the same weights and on
the same worlds, as every entry of ``[evaluations]`` has it: agents that are told nothing, that
consider nobody, that expect something else of the unseen, whose messages are lost. So the weights
are the same; but a team that acts under relations which it was not trained under meets situations
that it has not learned in, and a part of each difference is this shift of distribution.

For each condition of training, every evaluation is compared with that under the hierarchy of
training by evaluation success, as in the study `hierarchies`; and over all conditions by success
and decisions to the goal, equal measures of one question.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ...core.agents.loop import StepRecord
from ...studies.catalogue.hierarchies import analysis_of, estimates
from ...studies.catalogue.hierarchies.cases import HierarchyCase
from ...studies.catalogue.hierarchies.pooled import effects, lines_of
from ...studies.catalogue.study import (
    check_evaluated,
    check_evaluations,
    check_rule_bases,
    distinct,
)
from ...studies.results.analysis import EVALUATED, Analysis, Figures
from ...studies.results.notation import format_number
from ...studies.results.results import Results, Sizes
from ...studies.spec.spec import Spec
from ...studies.spec.tables import label_but
from ...studies.trials.session import Session
from ...studies.trials.trial import Trial, TrialResult

PUBLISHED = ("success", "agreement")
"""Measures of an episode that published results keep."""
TRAINED = "as trained"
"""How the hierarchy of training is called among the others."""
PARTED = (("neither", "considered only"), ("told only", TRAINED))
"""Names of evaluations by telling (rows) and considering (columns): told x considered."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated under other hierarchies."""
    check_evaluated(spec)
    check_rule_bases(spec, "who consider others and are told")
    check_evaluations(spec, 'silent.topology.told = "none"')


def measure(trial: Trial) -> TrialResult:
    """Train a team, let it act under all hierarchies; imported by name in workers."""
    session = Session.compiled(trial)
    session.train(trial.episodes)
    deciding: dict[str, list[float]] = {n: [] for n in (TRAINED, *dict(trial.evaluations))}

    def note(name: str, record: StepRecord) -> None:
        deciding[name].append(record.deciding)

    session.evaluate(partial(note, TRAINED))
    session.run_other_evaluations({name: partial(note, name) for name in deciding})
    numbers = {"robots": float(len(session.world.groups))}
    for name, settings in ((TRAINED, trial.settings), *trial.evaluations):
        numbers[f"messages.{name}"] = float(settings.arrange(session.world)[1].messages)
    usage = {f"decision.{name}": float(np.median(d)) for name, d in deciding.items()}
    return session.result(numbers, usage)


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    sizes = Sizes.of(results, results.of_phase("evaluation"))
    cases = []
    for condition, robots in sizes.counts.items():
        numbers = results.numbers(condition)
        value_of = label_but(results.columns.get(condition, {}), sizes.keys)
        for name, phase in ({TRAINED: "evaluation"} | results.other_evaluations(condition)).items():
            deciding = numbers[f"decision.{name}"]
            values = estimates(results, condition, phase, deciding, numbers[f"messages.{name}"])
            cases.append(HierarchyCase(condition, name, value_of, robots, sizes, values, phase))
    analysis = analysis_of(results, cases, TRAINED)
    pooled = lines_of(effects(results, cases, TRAINED), TRAINED)
    return replace(analysis, notes=(*analysis.notes, *pooled))


def draw(analysis: Analysis) -> Figures:
    """Return told x considered, if that is asked; and all differences from training.

    The second figure has a panel for each setting, if there are enough seeds to compare.
    """
    from ...studies.presentation.figures import draw_forest

    names = {case.hierarchy for case in analysis.cases if EVALUATED in case.values}
    figures = _draw_parted(analysis) if {*sum(PARTED, ())} <= names else {}
    unit = f"difference from {TRAINED}" if not names else f"success less that {TRAINED}"
    return figures | draw_forest("differences", analysis.differences, unit)


def _draw_parted(analysis: Analysis) -> Figures:
    """Draw success by telling and considering: four fields of a colour for each setting."""
    from ...studies.presentation import figures

    cases = sorted(analysis.cases, key=lambda case: (case.value_of, case.robots))
    by_name = {(case.setting, case.hierarchy): case.values[EVALUATED] for case in cases}
    settings = distinct(case.setting for case in cases)
    sizes = len({case.robots for case in cases})
    figure, panels = figures.grid(
        len(settings), sizes if sizes > 1 else 4, (1.9, 1.75), (0.9, 0.5), sharex=True, sharey=True
    )
    for axes, setting in zip(panels.flat, settings, strict=False):
        fields = np.array([[by_name[setting, name] for name in row] for row in PARTED], dtype=float)
        axes.imshow(fields[..., 0], "Blues", vmin=0, vmax=1)
        for row, column in np.ndindex(2, 2):
            value, low, high = map(format_number, fields[row, column])
            colour = "white" if fields[row, column, 0] > 0.5 else "black"
            write = partial(axes.text, column, ha="center", color=colour)
            write(row, value, va="bottom", fontsize=15)
            write(row + 0.08, f"[{low}, {high}]", va="top", fontsize=7)
        axes.set_title(setting, loc="left")
        axes.set_xticks((0, 1), ("nobody\nconsidered", "those below\nconsidered"))
        axes.set_yticks((0, 1), ("not told", "told"))
        axes.tick_params(length=0, labelsize=7.5)
        axes.spines[:].set_visible(False)
    figure.suptitle("evaluation success of the same weights, 95% intervals", fontsize=9)
    return {"edges": figure}
