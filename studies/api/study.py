"""A study in Python: load its results, then ask, compare, draw, replay and report.

Everything is computed when it is asked for, from what the study's directory holds.

Examples
--------
>>> import tempfile
>>> from nested_agents.studies.api.running import run
>>> out = tempfile.mkdtemp()
>>> spec = {"seeds": 2, "episodes": 1, "steps": 2, "evaluation": 1, "preset": "random"}
>>> study = run(spec, out, jobs=1, progress=False)
>>> study.conditions, study.table(["success last 5"]).titles
(('random',), ('success last 5',))
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
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.interface.measures import RETURN, SUCCESS
from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import closest
from ..catalogue.study import analyse_as, draw_figures, load_study, notes_of
from ..errors import SpecError
from ..presentation.headlines import below_random, headlines
from ..presentation.tables import SummaryTable, tabulate
from ..results.choices import choose_trials
from ..results.comparison import compare_conditions, missing_reference, power_with_first
from ..results.joining import join_sizes
from ..results.notation import wrapped
from ..results.results import Results, read
from ..spec.conditions import ConditionSettings
from ..spec.controls import control_lines
from ..spec.outline import StudyOutline, older_results, other_spec, sources_of
from ..spec.tables import SpecTable, TomlTable
from ..store import durable
from ..store.store import Store
from .comparison import Comparison
from .replay import Replay, draw_episode
from .status import Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...core.agents.team import Team
    from ...core.interface.scenario import Scenario
    from ..resilience.report import ResilienceReport
    from ..scalability.laws import Scaling
    from ..scalability.prediction import PredictionCheck
    from ..scalability.report import ScalabilityReport
    from ..workers.runner import Observer
    from .explaining import TeamExplanation

Place = str | PathLike[str]
"""Path of a directory or a file."""


class Defaults(NamedTuple):
    """Default arguments of `StudyResults.compare`."""

    measure: str | None = None
    by: str | None = None


@dataclass(frozen=True)
class StudyResults:
    """Results of the finished trials of one or several studies.

    Made by `run` and `load`. Printed, or shown by a notebook, it is its table.
    """

    outline: StudyOutline
    """Outline of the study."""
    results: Results
    """Data frames and arrays of the results."""
    failed: tuple[tuple[str, int, str], ...] = ()
    """Condition, seed and traceback of every failed trial."""
    remarks: tuple[str, ...] = ()
    """Remarks on the results, line by line."""
    _sources: Sources = field(default_factory=Sources, repr=False)
    _settings: Mapping[str, TomlTable] = field(default_factory=dict, repr=False)
    _directories: tuple[Path, ...] = ()
    _tables: Mapping[str, SpecTable] = field(default_factory=dict, repr=False)
    """Specs of several studies by name, if these are not parts of one."""
    _is_whole: bool = True
    _defaults: Defaults = field(default_factory=Defaults)

    @classmethod
    def of(cls, store: Store) -> StudyResults:
        """Return the results of an open study."""
        remarks = (older_results(store), None if store.is_older else other_spec(store))
        return cls(
            outline=StudyOutline.kept(store),
            results=read(store),
            failed=tuple(store.failed()),
            remarks=tuple(remark for remark in remarks if remark is not None),
            _sources=sources_of(store),
            _settings=store.settings(),
            _directories=(store.directory,),
        )

    @property
    def conditions(self) -> tuple[str, ...]:
        """Labels of the conditions of which any trial has finished."""
        return self.results.conditions

    @property
    def trials(self) -> pd.DataFrame:
        """One row per trial: its state, seconds [s] and numbers of the whole trial.

        What its columns are stands in ``trials.attrs["columns"]``.
        """
        return self.results.trials

    @property
    def episodes(self) -> pd.DataFrame:
        """One row per episode, counted from 0, and a column per measure.

        What its columns are, and their units, stands in ``episodes.attrs["columns"]``.
        """
        return self.results.episodes

    def table(self, columns: Sequence[str] = ()) -> SummaryTable:
        """Return conditions against estimates with their 95% intervals.

        Parameters
        ----------
        columns
            Headings of the columns, in this order; by default all.
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
            *self._of_controls,
        )

    @property
    def _of_controls(self) -> tuple[str, ...]:
        """Remarks on controls, and on learners that are below them, in lines."""
        there = {c: self._settings[c] for c in self.conditions if c in self._settings}
        return (*control_lines(there), *below_random(self.results, there))

    @property
    def power(self) -> tuple[str, ...]:
        """Power of comparisons with the first condition, as in `compare`."""
        is_own = self.results.measures and self.results.main.name in (SUCCESS.name, RETURN.name)
        return power_with_first(self.results) if is_own and self.results.phases else ()

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
        """Compare conditions seed by seed: effect, interval, p, and what could have been detected.

        Parameters
        ----------
        by
            A swept key, or the last part of it: conditions that agree in all others are compared.
            None, or ``condition``: all conditions with the first.
        measure
            A measure of episodes, ``steps``, ``return`` or a number of whole trials, by name; by
            default the first, success in studies, or the return where nothing is a success.
        phase
            Of the episodes; by default ``evaluation``.
        reference
            What the others are compared with; by default the first.

        Raises
        ------
        SpecError
            If there is no such key, measure, phase or reference.
        """
        by = by or self._defaults.by
        key = None if by == "condition" else by
        name = measure or self._defaults.measure or self.results.main.name
        compared = compare_conditions(self.results, name, phase, key, reference)
        missing = missing_reference(self.results) if reference is None and key is None else []
        return Comparison(compared, (*missing, *self._of_controls, *self.remarks))

    def where(self, choice: str) -> StudyResults:
        """Return the trials of a choice, such as ``"robots == 8 and seed < 5"``; see `chosen`."""
        part = choose_trials(self.results, choice, self._settings)
        if not part.conditions:
            raise SpecError(f"where = {choice!r}: no finished trial is so")
        return replace(self, results=part, failed=(), _is_whole=False)

    def as_study(self, name: str) -> StudyResults:
        """Return the same trials as another study analyses them, one of your own included.

        Raises
        ------
        SpecError
            If there is no such study.
        """
        own = Sources(Path())
        with own.active():
            load_study(name)
        outline = self.outline._replace(study=name)
        return replace(self, outline=outline, _sources=own, _is_whole=False)

    @property
    def figures(self) -> dict[str, Figure]:
        """The figures of the study by name."""
        with self._sources.active():
            return draw_figures(load_study(self.outline.study), self.analysis)

    def figure(self, name: str | None = None) -> Figure:
        """Return a figure of the study as matplotlib has it; the first unless named.

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
        """Answer which hierarchy scales, up to how many agents, and at which cost.

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
    ) -> tuple[str, ...]:
        """Write predictions for team sizes that were not run to a file; return remarks.

        Parameters
        ----------
        sizes
            Sizes to predict.
        path
            JSON file to write.
        measure
            Measure of performance, which is predicted along with the time of the task and costs.
        size
            The swept key that is the size; by default the only one of numbers.

        Raises
        ------
        SpecError
            If a size was run, or nothing can be predicted; one line.
        """
        from ..scalability.prediction import predict

        results = self.results_by_size(size)
        name = results.main.name if measure is None else measure
        file, remarks = predict(results, self.outline.table, name, size, sizes)
        file.write(Path(path))
        count = f"{path}: {len(file.predictions)} predictions, sha256 {file.digest}"
        return (count, *remarks)

    def check_prediction(self, path: Place) -> PredictionCheck:
        """Compare the predictions of a file with these results.

        Raises
        ------
        SpecError
            If the file was changed, or these results are those of another spec; one line.
        """
        from ..scalability.prediction import PredictionFile, check

        return check(PredictionFile.read(Path(path)), self.results, self.outline.table)

    def resilience(
        self,
        fault: str = "absent",
        measure: str | None = None,
        *,
        max_sets: int = 20,
        tolerance: float = 0.1,
        jobs: int | None = None,
        observer: Observer | None = None,
    ) -> ResilienceReport:
        """Measure what the loss of one, two or more agents costs the kept teams.

        Teams are not trained again. The number of losses grows until performance is at most half.

        Parameters
        ----------
        fault
            ``absent``, ``left`` or ``lost``, as in ``[[topology.failures]]``, or a kind of
            ``[[scenario.failures]]``, which takes an actuator, such as a wheel.
        measure
            Measure of episodes, higher being better; by default the first.
        max_sets
            Maximum number of sets of two or more that are lost; of more sets, random ones are.
        tolerance
            Share of the intact performance that a tolerated loss may cost.
        jobs
            Processes; None: one for every core.
        observer
            Is notified of the progress; None: it is shown on standard error.

        Raises
        ------
        SpecError
            If the study keeps no teams, a team has one agent only, or the scenario has no such
            fault; one line.
        """
        from .kept_teams import KeptTeams
        from .resilience import measure_resilience

        kept = KeptTeams.of(self.directory, self.trials, {"evaluations": {}})
        return measure_resilience(
            self.results,
            kept,
            partial(kept.evaluate, jobs=jobs, observer=observer),
            fault=fault,
            measure=measure,
            max_sets=max_sets,
            tolerance=tolerance,
        )

    def replay(
        self,
        condition: str | None = None,
        seed: int | None = None,
        episode: str = "last",
        path: Place | None = None,
    ) -> Replay:
        """Draw a recorded episode of a trial as an animation; a notebook shows it.

        Parameters
        ----------
        condition, seed
            Which trial; by default the first.
        episode
            ``first`` or ``last``; ``before`` or ``after`` where something fails.
        path
            Where to write, GIF or MP4; by default the study's folder ``replay``.

        Raises
        ------
        SpecError
            If there is no such trial or recording, or its scenario does not draw.
        """
        return draw_episode(self.directory, condition, seed, episode, path)

    def team(self, condition: str | None = None, seed: int | None = None) -> tuple[Scenario, Team]:
        """Return the world of a trial, and the team that was trained in it, ready to act.

        Parameters
        ----------
        condition, seed
            Which trial; by default the first.

        Raises
        ------
        SpecError
            If there is no such trial, it has not finished, or the study keeps no teams.
        """
        from ..trials.keeping import check_teams, finished_trial
        from ..trials.session import Session

        with Store.open(self.directory) as store:
            check_teams(store)
            trial = finished_trial(store, condition, seed)
            with trial.sources.active():
                session = Session.restored(trial, store.recording(trial.identity, durable.TEAM))
        return session.scenario, session.team

    def explain(self, condition: str | None = None, seed: int | None = None) -> TeamExplanation:
        """Explain a trained team: its rules in words, its policy, its self-model.

        Unless the study keeps its teams, training is run again, and must give the episodes kept.

        Parameters
        ----------
        condition, seed
            Which trial; by default the first.

        Raises
        ------
        SpecError
            If there is no such trial, it has not finished, or its team has no rules.
        """
        from .explaining import explain_team  # its drawings take their time

        return explain_team(self.directory, condition, seed)

    @property
    def status(self) -> Status:
        """Progress of the study: finished, running, failed and remaining trials, and time left."""
        return Status.of(self.directory)

    def report(self, path: Place | None = None) -> Path:
        """Write the whole study as one self-contained HTML file and return its path.

        Parameters
        ----------
        path
            Of the file; by default ``report.html`` in the study's directory.

        Raises
        ------
        SpecError
            If the path is no HTML file, or these are not the results of one whole study.
        """
        from ..report.page import check_path, page  # its templates and packers take their time

        if not self._is_whole:
            raise SpecError("report: is of a whole study, not of a part of it or of another one")
        file = self.directory / "report.html" if path is None else Path(path)
        check_path(file)
        durable.write(file, page(self.directory).encode())
        return file

    @property
    def directory(self) -> Path:
        """Directory of the study.

        Raises
        ------
        SpecError
            If these are the results of several studies, or of a published file.
        """
        if len(self._directories) != 1:
            raise SpecError("these are not the results of one study that is kept in a directory")
        return self._directories[0]

    def __str__(self) -> str:
        return "\n".join([str(self.table()), "", *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<h4>{escape(self.outline.study)}</h4>{self.table().html}"
