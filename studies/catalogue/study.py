"""Studies: measurement of a trial, analysis of all trials, and figures.

A spec names a study of the catalog, ``study = "scaling"``, or a class in a file, ``study =
"mine.py:Mine"``, which inherits `Study` or has the same attributes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import SpecError, refused
from ..laws.size_axis import other_key
from ..results.analysis import Analysis, Figures, identity_lines
from ..results.results import Results
from ..spec.studies import STUDIES

if TYPE_CHECKING:
    from ..spec.spec import Spec
    from ..trials.trial import Trial, TrialResult

T = TypeVar("T")


PARTS = ("measure", "analyse", "draw")
"""Attributes that every study needs."""
OPTIONS = ("check", "comparisons", "NUMBERS", "PUBLISHED", "TIMED")
"""Optional attributes; `Study` has their defaults."""


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
    """Numbers of whole trials that the analysis needs. Trials without them are refused."""
    PUBLISHED: Sequence[str] | None = None
    """Measures in published results; None for all."""
    TIMED: bool = True
    """Whether trials are long enough for meaningful times."""
    analyse: Callable[[Results], Any]
    """Returns the estimates of results with the attribute `table` of `Summary` rows, and optional
    attributes of `nested_agents.studies.results.analysis.Analysis`."""

    def check(self, spec: Spec) -> None:
        """Raise `SpecError` if the spec does not fit the study."""

    def comparisons(self, spec: Spec) -> int:
        """Return the number of comparisons over which p is adjusted.

        By default they are those of `compare`: with the first condition, or within each size.
        """
        columns = {condition.label: condition.columns for condition in spec.conditions()}
        by = other_key(columns)
        groups = {repr([row[k] for k in row if by and k != by]) for row in columns.values()}
        return len(columns) - len(groups)

    def measure(self, trial: Trial) -> TrialResult:
        """Run one trial; imported by name in worker processes."""
        return measure(trial)

    def draw(self, analysis: Analysis) -> Figures:
        """Return the figures of an analysis by name."""
        return {}


def load_study(name: str) -> Study:
    """Return a study by its name in `STUDIES` or in a user's file.

    Raises
    ------
    SpecError
        If the study is unknown, its file is not trusted, or it lacks a function.
    """
    with refused(f"study = {name!r}: "):
        entry = STUDIES.find(name)
    missing = [part for part in PARTS if not callable(getattr(entry, part, None))]
    if missing:
        raise SpecError(f"study = {name!r}: has no {missing[0]}, needs {', '.join(PARTS)}")
    source = entry() if isinstance(entry, type) else entry
    study = Study()
    own = {part: getattr(source, part) for part in dir(source) if part in (*PARTS, *OPTIONS)}
    vars(study).update(own)
    return study


def notes_of(analysis: Any) -> tuple[str, ...]:
    """Return the remarks of an analysis, which those of users may lack."""
    return tuple(getattr(analysis, "notes", ()))


def measure(trial: Trial) -> TrialResult:
    """Run a trial without further measurements."""
    from ..trials.session import run_trial  # reading results does not import learners

    return run_trial(trial)


def check_evaluated(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated."""
    if spec.evaluation < 1:
        raise SpecError(
            f"evaluation = 0: {spec.study} compares evaluation success, needs 1 or more"
        )


def check_evaluations(spec: Spec, example: str) -> None:
    """Raise `SpecError` unless trained teams have further evaluations, as in an `example`."""
    if not spec.evaluations:
        raise SpecError(f"evaluations: missing; {spec.study} needs one at least, as {example}")


def check_rule_bases(spec: Spec, why: str) -> None:
    """Refuse conditions without fuzzy agents.

    Parameters
    ----------
    spec
        The spec.
    why
        Reason why the study needs rule bases, for the message.

    Raises
    ------
    SpecError
        If a condition has another learner; the message names the allowed ones.
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
    """Return the analysis of results by a study, which may differ from the one that ran.

    Raises
    ------
    SpecError
        If the study is unknown, or the results lack episodes or numbers of trials that it needs.
    """
    study = load_study(name)
    if results.conditions and not results.phases:
        raise SpecError(
            f"study = {name!r}: needs episodes, and this table holds only numbers of trials, "
            "which compare reads with --measure"
        )
    for needed in study.NUMBERS:
        for condition in results.conditions:
            if needed not in results.numbers(condition):
                raise SpecError(
                    f"study = {name!r}: needs {needed} of every trial, which those of "
                    f"{condition!r} have not measured; of an exported study it is in the table of "
                    "trials, in the same folder; for episodes alone: --as learning-curve"
                )
    analysis = study.analyse(results)
    same = identity_lines(results.identical)
    if same and isinstance(analysis, Analysis):
        analysis = replace(analysis, notes=(*analysis.notes, *same))
    return analysis


def select_published(name: str, results: Results) -> Results:
    """Return the part of results that a study publishes, see `Study.PUBLISHED` and `TIMED`."""
    study = load_study(name)
    measures = results.measures
    published = study.PUBLISHED
    if published is not None:
        measures = tuple(m for m in measures if m.name in published)
    trials = results.trials if study.TIMED else results.trials.drop(columns=list(results.usage))
    same = results.identical
    return replace(results, measures=measures, trials=trials, same_conditions=same)


def distinct(values: Iterable[T]) -> list[T]:
    """Return values without repetition, in the order of their first occurrence.

    >>> distinct("banana")
    ['b', 'a', 'n']
    """
    return list(dict.fromkeys(values))


def system_of(results: Results, condition: str) -> tuple[str, dict[str, object]]:
    """Return the name of a condition's override and its other swept values by key."""
    columns = dict(results.columns.get(condition, {}))
    name = str(columns.pop("name", condition))
    return name, {key: value for key, value in columns.items() if value != ""}


def draw_figures(study: Study, analysis: Any) -> Figures:
    """Return the figures of an analysis in the common style; none for an empty table."""
    from ..presentation.figures import apply_style, spell_dollars  # matplotlib takes its time

    with apply_style():
        figures = study.draw(analysis) if analysis.table else {}
        names = [line.condition for line in analysis.table]
        return {name: spell_dollars(figure, names) for name, figure in figures.items()}


def measure_by_name(trial: Trial) -> TrialResult:
    """Run a trial by the study it names; imported by name in worker processes."""
    return load_study(trial.study).measure(trial)
