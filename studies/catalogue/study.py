"""What a study is: a measure of one trial, an analysis of all, and figures of the analysis.

A study is a module, or a class, that offers these, and one line in `STUDIES`
or ``study = "mine.py:Mine"`` in a spec. It may also offer ``check(spec)``, which raises `SpecError`
if the spec has not what it needs; and ``NUMBERS``, names of the numbers of whole trials that its
analysis rests on, so that trials of other studies that lack them are refused; ``PUBLISHED``, names
of the measures of an episode that its published results keep, all unless it says so; and ``TIMED``,
False if its trials are too short for their times to say anything.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, cast

from ..errors import SpecError, refused
from ..results.analysis import Analysis, Figures, identity_lines
from ..results.results import Results
from ..spec.studies import STUDIES

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult


PARTS = ("measure", "analyse", "draw")
"""What every study offers."""


class Study(Protocol):
    """The functions of a study's module."""

    def measure(self, trial: Trial) -> TrialResult:
        """Run one trial; imported by name in worker processes."""

    def analyse(self, results: Results) -> Any:
        """Turn results into estimates; its attribute `table` holds the `Summary` lines.

        Further attributes are those of `nested_agents.studies.results.analysis.Analysis`, each of
        which may be missing.
        """

    def draw(self, analysis: Any) -> Figures:
        """Return the figures of an analysis by name."""


def load_study(name: str) -> Study:
    """Return the study of a name in `STUDIES`, or of a user's file.

    Raises
    ------
    SpecError
        If there is none, it may not be run, or lacks a function that studies have; one line.
    """
    with refused(f"study = {name!r}: "):
        entry = STUDIES.find(name)
    study = entry() if isinstance(entry, type) else entry
    missing = [part for part in PARTS if not callable(getattr(study, part, None))]
    if missing:
        raise SpecError(f"study = {name!r}: has no {missing[0]}, needs {', '.join(PARTS)}")
    return cast(Study, study)


def measure(trial: Trial) -> TrialResult:
    """Run a trial that is measured by its episodes alone."""
    from ..trials.session import run_trial  # who only reads results needs nothing that learns

    return run_trial(trial)


def check_evaluated(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated."""
    if spec.evaluation < 1:
        raise SpecError(
            f"evaluation = 0: {spec.study} compares evaluation success, needs 1 or more"
        )


def check_evaluations(spec: Spec, example: str) -> None:
    """Raise `SpecError` unless trained teams are evaluated otherwise, too, as in an `example`."""
    if not spec.evaluations:
        raise SpecError(f"evaluations: missing; {spec.study} needs one at least, as {example}")


def check_rule_bases(spec: Spec, why: str) -> None:
    """Refuse conditions whose learner is no hierarchy of fuzzy agents.

    Parameters
    ----------
    spec
        Of a study that looks into the agents.
    why
        What it looks for, to be read after "agents with rule bases".

    Raises
    ------
    SpecError
        If there is such a condition; one line, which names the learners that will do.
    """
    from ...core.learners import LEARNERS, LearnerSettings

    for condition in spec.conditions():
        learner = condition.settings.learner
        if not isinstance(learner, LearnerSettings):
            able = [n for n in LEARNERS.names() if issubclass(LEARNERS.model(n), LearnerSettings)]
            raise SpecError(
                f"learner.kind = {learner.kind!r}: {spec.study} needs agents with rule bases, "
                f"{why}, allowed {', '.join(able)} (condition {condition.label!r})"
            )


def analysed(name: str, results: Results) -> Any:
    """Return what a study makes of results, which may be those of another study.

    Raises
    ------
    SpecError
        If there is no such study, or trials lack what it rests on; one line.
    """
    study = load_study(name)
    for needed in getattr(study, "NUMBERS", ()):
        for condition in results.conditions:
            if needed not in results.numbers(condition):
                raise SpecError(
                    f"study = {name!r}: needs {needed} of every trial, which those of "
                    f"{condition!r} have not measured"
                )
    analysis, same = study.analyse(results), identity_lines(results.identical)
    if same and isinstance(analysis, Analysis):
        analysis = replace(analysis, notes=(*analysis.notes, *same))
    return analysis


def published_part(name: str, results: Results) -> Results:
    """Return what a study's results are published with, see `PUBLISHED` and `TIMED` above."""
    study = load_study(name)
    wanted = getattr(study, "PUBLISHED", [m.name for m in results.measures])
    usage = [] if getattr(study, "TIMED", True) else list(results.usage)
    return replace(
        results,
        measures=tuple(m for m in results.measures if m.name in wanted),
        trials=results.trials.drop(columns=usage),
    )


def drawn(study: Study, analysis: Any) -> Figures:
    """Return the figures of an analysis by name, as all figures look; none of an empty table."""
    from ..presentation.figures import spell_dollars, styled  # matplotlib takes its time

    with styled():
        figures = study.draw(analysis) if analysis.table else {}
        names = [line.condition for line in analysis.table]
        return {name: spell_dollars(figure, names) for name, figure in figures.items()}


def measured(trial: Trial) -> TrialResult:
    """Run a trial by the study that it names; imported by name in worker processes."""
    return load_study(trial.study).measure(trial)
