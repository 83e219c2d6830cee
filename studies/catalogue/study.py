"""Studies: the measurement of one trial, the analysis of all trials, and its figures.

A spec names a study of the catalog, ``study = "scaling"``, or a class of a file,
``study = "mine.py:Mine"``, which inherits `Study` or offers the same attributes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from ...core.interface.plain import MISSING, offered
from ..errors import SpecError, refused
from ..results.analysis import Analysis, Figures, identity_lines
from ..results.results import Results
from ..spec.studies import STUDIES

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

T = TypeVar("T")


PARTS = ("measure", "analyse", "draw")
"""Attributes that every study needs."""
OPTIONS = {"check": "check", "NUMBERS": "numbers", "PUBLISHED": "published", "TIMED": "timed"}
"""Optional attributes, and the field of `LoadedStudy` for each."""


def accept(spec: Spec) -> None:
    """Accept any spec."""


class Study:
    """Base class of studies.

    A subclass defines ``analyse(results)``, which returns the `Analysis` of finished trials;
    everything else has a default.

    Examples
    --------
    >>> class Mine(Study):
    ...     def analyse(self, results):
    ...         return Analysis(())
    >>> Mine().draw(Mine().analyse(None))
    {}
    """

    NUMBERS: Sequence[str] = ()
    """Numbers of whole trials that the analysis needs. Trials of other studies without them are
    refused."""
    PUBLISHED: Sequence[str] | None = None
    """Measures of an episode that published results keep; None: all."""
    TIMED: bool = True
    """False if trials are too short for their times to be meaningful."""

    def check(self, spec: Spec) -> None:
        """Raise `SpecError` unless the spec has what the study needs."""

    def measure(self, trial: Trial) -> TrialResult:
        """Run one trial; called by name in worker processes."""
        return measure(trial)

    def draw(self, analysis: Analysis) -> Figures:
        """Return the figures of an analysis by name."""
        return {}


@dataclass(frozen=True)
class LoadedStudy:
    """The attributes of a study, with defaults for those that it lacks."""

    measure: Callable[[Trial], TrialResult]
    """Runs one trial; imported by name in worker processes."""
    analyse: Callable[[Results], Any]
    """Turns results into estimates; its attribute `table` holds the `Summary` lines. Further ones
    are those of `nested_agents.studies.results.analysis.Analysis`, each of which may be missing."""
    draw: Callable[[Any], Figures]
    """Returns the figures of an analysis by name."""
    check: Callable[[Spec], None] = accept
    """Raises `SpecError` unless the spec has what the study needs."""
    numbers: Sequence[str] = ()
    """Names of the numbers of whole trials that the analysis needs."""
    published: Sequence[str] | None = None
    """Names of the measures of an episode that published results keep; None: all."""
    timed: bool = True
    """Whether trials are long enough for their times to be meaningful."""


def load_study(name: str) -> LoadedStudy:
    """Return the study of a name in `STUDIES`, or of a user's file.

    Raises
    ------
    SpecError
        If there is none, it may not be run, or lacks a function that studies have; one line.
    """
    with refused(f"study = {name!r}: "):
        entry = STUDIES.find(name)
    missing = [part for part in PARTS if not callable(offered(entry, part))]
    if missing:
        raise SpecError(f"study = {name!r}: has no {missing[0]}, needs {', '.join(PARTS)}")
    source = entry() if isinstance(entry, type) else entry
    names = OPTIONS | {part: part for part in PARTS}
    known = {own: offered(source, part, MISSING) for part, own in names.items()}
    return LoadedStudy(**{own: part for own, part in known.items() if part is not MISSING})


def notes_of(analysis: Any) -> tuple[str, ...]:
    """Return what an analysis says in words, line by line; one of your own may say nothing."""
    return tuple(offered(analysis, "notes", ()))


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


def analyse_as(name: str, results: Results) -> Any:
    """Return what a study makes of results, which may be those of another study.

    Raises
    ------
    SpecError
        If there is no such study, or trials lack what it rests on; one line.
    """
    study = load_study(name)
    for needed in study.numbers:
        for condition in results.conditions:
            if needed not in results.numbers(condition):
                raise SpecError(
                    f"study = {name!r}: needs {needed} of every trial, which those of "
                    f"{condition!r} have not measured"
                )
    analysis = study.analyse(results)
    same = identity_lines(results.identical)
    if same and isinstance(analysis, Analysis):
        analysis = replace(analysis, notes=(*analysis.notes, *same))
    return analysis


def select_published(name: str, results: Results) -> Results:
    """Return what a study's results are published with, see `PUBLISHED` and `TIMED` above."""
    study = load_study(name)
    measures = results.measures
    if study.published is not None:
        measures = tuple(m for m in measures if m.name in study.published)
    trials = results.trials if study.timed else results.trials.drop(columns=list(results.usage))
    return replace(results, measures=measures, trials=trials)


def distinct(values: Iterable[T]) -> list[T]:
    """Return values without repetition, in the order in which they first come.

    >>> distinct("banana")
    ['b', 'a', 'n']
    """
    return list(dict.fromkeys(values))


def system_of(results: Results, condition: str) -> tuple[str, dict[str, object]]:
    """Return the name of a condition's override, and what else is swept, by key."""
    columns = dict(results.columns.get(condition, {}))
    name = str(columns.pop("name", condition))
    return name, {key: value for key, value in columns.items() if value != ""}


def draw_figures(study: LoadedStudy, analysis: Any) -> Figures:
    """Return the figures of an analysis by name, as all figures look; none of an empty table."""
    from ..presentation.figures import apply_style, spell_dollars  # matplotlib takes its time

    with apply_style():
        figures = study.draw(analysis) if analysis.table else {}
        names = [line.condition for line in analysis.table]
        return {name: spell_dollars(figure, names) for name, figure in figures.items()}


def measure_by_name(trial: Trial) -> TrialResult:
    """Run a trial by the study that it names; imported by name in worker processes."""
    return load_study(trial.study).measure(trial)
