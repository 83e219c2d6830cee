"""Results of a study in memory: tables, comparisons, figures and scalability.

Everything is computed when it is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from html import escape
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from ...core.interface.measures import RETURN, SUCCESS
from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import closest, expect
from ..catalogue.study import analyse_as, draw_figures, load_study, notes_of
from ..errors import SpecError
from ..laws.size_axis import key_beside_size
from ..presentation.headlines import below_random, headlines
from ..presentation.tables import SummaryTable, tabulate
from ..results.choices import choose_trials
from ..results.comparison import compare_conditions, missing_reference, power_of_seeds
from ..results.joining import join_sizes
from ..results.measured import default_measure
from ..results.notation import listed, wrapped
from ..results.results import Results
from ..spec.conditions import ConditionSettings
from ..spec.controls import control_lines
from ..spec.outline import StudyOutline
from ..spec.tables import SpecTable, TomlTable, is_named_after
from .comparison import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..laws.universal import Scaling
    from ..scalability.prediction import PredictionCheck, Predictions
    from ..scalability.report import ScalabilityReport

Place = str | PathLike[str]
"""Path of a directory or a file."""


@dataclass(frozen=True)
class StudyData:
    """Results of the finished trials of one or several studies.

    Printed, or shown by a notebook, it is its table.
    """

    outline: StudyOutline
    """Outline of the study."""
    results: Results
    """Data frames and arrays of the results."""
    failed: tuple[tuple[str, int, str], ...] = ()
    """Condition, seed and traceback of every failed trial."""
    remarks: tuple[str, ...] = ()
    """Remarks on the results, line by line."""
    _sources: Sources = field(
        default_factory=partial(Sources, brought_by="these results"), repr=False
    )
    _settings: Mapping[str, TomlTable] = field(default_factory=dict, repr=False)
    _directories: tuple[Path, ...] = ()
    _tables: Mapping[str, SpecTable] = field(default_factory=dict, repr=False)
    """Specs of several studies by name, if these are not parts of one."""
    _is_whole: bool = True
    _defaults: tuple[str | None, str | None] = (None, None)
    """Measure and key that `compare` uses by default."""

    @property
    def conditions(self) -> tuple[str, ...]:
        """Labels of the conditions with at least one finished trial."""
        return self.results.conditions

    @property
    def trials(self) -> pd.DataFrame:
        """One row per trial: its state, durations [s] and numbers of the whole trial.

        ``trials.attrs["columns"]`` describes the columns. It is a copy: changing it changes no
        result.
        """
        return self.results.trials.copy()

    @property
    def episodes(self) -> pd.DataFrame:
        """One row per episode, counted from 0, and a column per measure.

        ``episodes.attrs["columns"]`` describes the columns and their units. It is a copy: changing
        it changes no result.
        """
        return self.results.episodes.copy()

    def table(self, columns: Sequence[str] = ()) -> SummaryTable:
        """Return the table of estimates with 95% intervals, one row per condition.

        Parameters
        ----------
        columns
            Headings of the columns to show, in this order; by default all.
        """
        return tabulate(self.analysis.table, columns)

    @property
    def notes(self) -> tuple[str, ...]:
        """Verdicts and their power, line by line."""
        sentences = map(wrapped, headlines(self.results, self._settings))
        return (
            *missing_reference(self.results),
            *chain.from_iterable(sentences),
            *notes_of(self.analysis),
            *self._not_shown,
            *self._of_controls,
        )

    @property
    def _not_shown(self) -> list[str]:
        """Further evaluations that the study's table has not, in lines."""
        table = self.table()
        shown = " ".join((*table.titles, *(line.condition for line in table.lines)))
        every = map(self.results.other_evaluations, self.conditions)
        phases = {phase: name for own in every for name, phase in own.items()}
        hidden = [phase for phase, name in phases.items() if name not in shown]
        return listed("Further evaluations, see compare --phase", hidden)

    @property
    def _of_controls(self) -> tuple[str, ...]:
        """Remarks on controls, and on learners that do worse than controls, line by line."""
        there = {c: self._settings[c] for c in self.conditions if c in self._settings}
        return (*control_lines(there), *below_random(self.results, there))

    @property
    def power(self) -> tuple[str, ...]:
        """Power of the comparisons that `compare` makes by default."""
        is_own = self.results.measures and self.results.main.name in (SUCCESS.name, RETURN.name)
        if not is_own or not self.results.phases:
            return ()
        return power_of_seeds(self.results, key_beside_size(self.results))

    @cached_property
    def analysis(self) -> Any:
        """Analysis of the results by the study, see `nested_agents.studies.catalogue.study`."""
        with self._sources.active():
            return analyse_as(self.outline.study, self.results)

    def compare(
        self,
        by: str | None = None,
        measure: str | None = None,
        *,
        phase: str | None = None,
        reference: str | None = None,
    ) -> Comparison:
        """Compare conditions seed by seed: effect, interval, p and detectable difference.

        Parameters
        ----------
        by
            A swept key, or its last part: compares conditions that differ only in this key.
            ``condition``: compares all conditions with the first. By default the key that is swept
            besides the team size, if there is one such key and no reference; else ``condition``.
        measure
            Name of a measure of episodes, ``steps``, ``return``, or a number of whole trials. By
            default the first measure: success, or the return if nothing is a success. Of a study
            of failures it is ``recovered``, unless a phase is named.
        phase
            Phase of the episodes; by default ``evaluation``.
        reference
            Condition with which the others are compared; by default the first.

        Raises
        ------
        SpecError
            If there is no such key, measure, phase or reference.
        """
        own_measure, default_by = self._defaults
        by = by or default_by or (None if reference else key_beside_size(self.results))
        key = None if by == "condition" else by
        if key is not None and is_named_after(key, self.results.columns, self._settings):
            key = "name"
        usual = default_measure(self.results) if phase is None else self.results.main.name
        name = measure or own_measure or usual
        compared = compare_conditions(self.results, name, phase, key, reference)
        missing = missing_reference(self.results) if reference is None and key is None else []
        return Comparison(compared, (*missing, *self._of_controls, *self.remarks))

    def where(self, choice: str) -> Self:
        """Return the trials that match a choice, such as ``"robots == 8 and seed < 5"``."""
        expect("a choice, such as 'robots == 8'", str, where=choice)
        part = choose_trials(self.results, choice, self._settings)
        if not part.conditions:
            raise SpecError(f"where = {choice!r}: no finished trial matches")
        return replace(self, results=part, failed=(), _is_whole=False)

    def as_study(self, name: str) -> Self:
        """Return the same trials with the analysis of another study, which may be your own.

        Raises
        ------
        SpecError
            If there is no such study.
        """
        expect("the name of a study", str, study=name)
        own = Sources(Path())
        with own.active():
            load_study(name)
        outline = self.outline._replace(study=name)
        return replace(self, outline=outline, _sources=own, _is_whole=False)

    @property
    def figures(self) -> dict[str, Figure]:
        """Figures of the study by name."""
        with self._sources.active():
            return draw_figures(load_study(self.outline.study), self.analysis)

    def figure(self, name: str | None = None) -> Figure:
        """Return a figure of the study by name; by default the first.

        Raises
        ------
        SpecError
            If there is no such figure.
        """
        figures = self.figures
        if not figures:
            raise SpecError(f"study = {self.outline.study!r}: has no figure of these results")
        if name is not None and name not in figures:
            raise SpecError(f"figure = {name!r}: {closest(name, figures)}")
        return figures[next(iter(figures)) if name is None else name]

    def condition_settings(self) -> dict[str, ConditionSettings]:
        """Return the settings of each condition, as far as they can be read."""
        from ..spec.spec import Spec  # imports all scenarios

        settings: dict[str, ConditionSettings] = {}
        with self._sources.active(), suppress(ValueError, KeyError, ImportError):
            if not self._settings:
                spec = Spec.of(self.outline.table, self._sources)
                return {c.label: c.settings for c in spec.conditions()}
            for condition, table in self._settings.items():
                settings[condition] = ConditionSettings.model_validate(table)
        return settings

    def results_by_size(self, size: str | None) -> Results:
        """Return the results with several studies joined along a swept key, see `join_sizes`."""
        if not self._tables:
            return self.results
        return join_sizes(self.results, self._tables, self._settings, size)

    def scalability(
        self,
        measure: str | None = None,
        *,
        size: str | None = None,
        scaling: Scaling | None = None,
        criterion: float | None = None,
        budget: str = "",
    ) -> ScalabilityReport:
        """Answer which hierarchy scales, up to how many agents, and at what cost.

        Parameters
        ----------
        measure
            Measure of performance; by default the first, which is success, or the return where
            nothing is a success.
        size
            The swept key that is the size, or its last part, as ``robots``; by default the only one
            of numbers.
        scaling
            ``strong`` if the task is the same for all sizes, ``weak`` if it grows with the team; by
            default as the scenario says.
        criterion
            Also count the decisions of training until this share of five episodes in a row
            succeeds.
        budget
            Limits of costs, as ``"messages <= 50, decision_ms <= 100"``.

        Raises
        ------
        SpecError
            If there is only one size, or a cost of the budget was not measured; one line.
        """
        from ..scalability.report import analyze

        results = self.results_by_size(size)
        settings = self.condition_settings()
        return analyze(results, settings, measure, size, scaling, criterion, budget)

    def predict_sizes(
        self,
        sizes: Sequence[int],
        path: Place,
        measure: str | None = None,
        *,
        size: str | None = None,
    ) -> Predictions:
        """Predict team sizes that were not run, and write the predictions to a file.

        Parameters
        ----------
        sizes
            Sizes to predict.
        path
            JSON file to write, which must not exist.
        measure
            Measure of performance, which is predicted along with the time of the task and costs.
        size
            The swept key that is the size; by default the number of robots or agents.

        Raises
        ------
        SpecError
            If a size was run, nothing can be predicted, or the file exists; one line.
        """
        from ..scalability.prediction import Predictions, predict
        from .search_methods import method_remarks

        if Path(path).exists():
            raise SpecError(f"{path}: exists; a prediction does not replace a file")
        results = self.results_by_size(size)
        name = results.main.name if measure is None else measure
        file, remarks = predict(results, self.outline.table, name, size, sizes)
        file.write(Path(path))
        count = f"{path}: {len(file.predictions)} predictions, sha256 {file.digest}"
        with self._sources.active():
            methods = method_remarks(self.condition_settings(), results, size, sizes)
        lines = chain.from_iterable(map(wrapped, (count, *remarks, *methods)))
        return Predictions(file, tuple(lines))

    def check_prediction(self, path: Place) -> PredictionCheck:
        """Compare the predictions of a file with these results.

        Raises
        ------
        SpecError
            If the file was changed, or these results are those of another spec; one line.
        """
        from ..scalability.prediction import PredictionFile, check

        file = PredictionFile.read(Path(path))
        return check(file, self.results_by_size(file.size), self.outline.table)

    def __str__(self) -> str:
        try:
            return "\n".join([str(self.table()), "", *self.notes])
        except SpecError as error:  # the analysis needs what these results lack
            return str(error)

    __repr__ = __str__

    def _repr_html_(self) -> str | None:
        with suppress(SpecError):  # notebooks then show the text
            return f"<h4>{escape(self.outline.study)}</h4>{self.table().html}"
        return None
