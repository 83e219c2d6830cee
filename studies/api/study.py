"""A study in Python: run it or load it, then ask, compare, draw, replay and report.

Everything is computed when it is asked for, from what the study's directory holds.

Examples
--------
>>> import tempfile
>>> out = tempfile.mkdtemp()
>>> spec = {"seeds": 2, "episodes": 1, "steps": 2, "evaluation": 1, "preset": "random"}
>>> study = run(spec, out, jobs=1, progress=False)
>>> study.conditions, study.table(["success last 5"]).titles
(('random',), ('success last 5',))
"""

from __future__ import annotations

import base64
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.agents.team import Team
from ...core.interface.measures import SUCCESS
from ...core.interface.scenario import Scenario
from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import closest
from ..catalogue.study import analyse_as, draw_figures, load_study
from ..errors import SpecError
from ..presentation.progress import Terminal, count
from ..presentation.tables import SummaryTable, tabulate
from ..results import published
from ..results.analysis import Difference
from ..results.contrasts import Aggregates, Contrasts, aggregate, contrasts
from ..results.power import SMALLEST, USUAL_DEVIATION, power_text
from ..results.results import Results, chosen, read, together
from ..spec.outline import StudyOutline, other_spec, sources_of
from ..store import durable
from ..store.store import Store
from ..workers.runner import Backend, Observer

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..spec.spec import Spec


@dataclass(frozen=True)
class Comparison:
    """Conditions compared by one measure; printed or shown by a notebook, table and verdicts."""

    contrasts: Contrasts
    """The analysis."""

    @cached_property
    def table(self) -> SummaryTable:
        """Estimates and differences, in all forms."""
        return tabulate(self.contrasts.table)

    @property
    def differences(self) -> tuple[Difference, ...]:
        """Every difference with its interval, and p raw and adjusted."""
        return self.contrasts.differences

    @property
    def verdicts(self) -> tuple[str, ...]:
        """What was found, and what could have been detected, line by line."""
        return self.contrasts.notes

    @cached_property
    def statistics(self) -> Aggregates:
        """Interquartile means, probabilities of improvement and performance profiles.

        Raises
        ------
        SpecError
            If no two conditions have two seeds each.
        """
        return aggregate(self.contrasts)

    @cached_property
    def aggregated(self) -> SummaryTable:
        """The table of `statistics`, in all forms."""
        return tabulate(self.statistics.table)

    def figure(self) -> Figure:
        """Return performance profiles, and the interquartile mean by episode of training."""
        from ..presentation.figures import draw_profiles  # matplotlib takes its time

        return draw_profiles(self.statistics)

    def __str__(self) -> str:
        return "\n".join([str(self.table), "", *self.verdicts])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        lines = "\n".join(map(escape, self.verdicts))
        return f"{self.table.html}<pre>{lines}</pre>"


MOST_BYTES = 20_000_000
"""Of an animation that a notebook is given."""


class Replay(NamedTuple):
    """An animation."""

    path: Path
    """Where it is."""
    title: str
    """Condition, seed and episode."""

    def _repr_html_(self) -> str:
        content = self.path.read_bytes()
        if self.path.suffix != ".gif" or len(content) > MOST_BYTES:
            return f"{self.title}: {self.path}"
        encoded = base64.b64encode(content).decode("ascii")
        return f"<img alt='{self.title}' src='data:image/gif;base64,{encoded}'>"


Place = str | PathLike[str]
"""Of a directory or a file."""


@dataclass(frozen=True)
class StudyResults:
    """What the finished trials of a study measured, or those of several studies together.

    Made by `run` and `load`. Printed, or shown by a notebook, it is its table.
    """

    outline: StudyOutline
    """What the study consists of."""
    results: Results
    """Its frames, and arrays of what they hold."""
    failed: tuple[tuple[str, int, str], ...] = ()
    """Condition, seed and traceback of every failed trial."""
    remarks: tuple[str, ...] = ()
    """What must be said of the results, in lines."""
    _sources: Sources = field(default_factory=Sources, repr=False)
    _settings: Mapping[str, Any] = field(default_factory=dict, repr=False)
    _directories: tuple[Path, ...] = ()
    _is_whole: bool = True

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
        """Return conditions against estimates with their 95 % intervals.

        Parameters
        ----------
        columns
            Headings of the columns, in this order; by default all.
        """
        return tabulate(self.analysis.table, columns)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the study says of its results, verdicts and their power, line by line."""
        return tuple(getattr(self.analysis, "notes", ()))

    @property
    def unlearned(self) -> tuple[str, ...]:
        """Conditions that learn, but have neither more success nor return than frozen weights.

        In evaluation; known where there is a frozen condition in the same scenario.
        """
        evaluations = self.results.episodes.query("phase == 'evaluation'")
        columns = ["condition", SUCCESS.name, "return"]
        means = evaluations.reindex(columns=columns).groupby("condition").mean()
        frozen, others = dict[str, Any](), list[tuple[str, str]]()
        for c in means.index.intersection(list(self._settings), sort=False):
            learner, scenario = (self._settings[c][name] for name in ("learner", "scenario"))
            if learner["kind"] != "frozen":
                others.append((c, repr(scenario)))
            elif learner["decision"]["rule"] == "value":
                frozen[repr(scenario)] = means.loc[c]
        return tuple(c for c, s in others if s in frozen and (means.loc[c] <= frozen[s]).all())

    @property
    def power(self) -> tuple[str, ...]:
        """What comparisons with the first condition can find, supposing a usual deviation."""
        comparisons = len(self.conditions) - 1
        if comparisons < 1:
            return ()
        seeds = min(len(self.results.seeds(condition)) for condition in self.conditions)
        return tuple(power_text(seeds, comparisons, USUAL_DEVIATION, SMALLEST))

    @cached_property
    def analysis(self) -> Any:
        """What the study makes of its results, see `nested_agents.studies.catalogue.study`."""
        with self._sources.active():
            return analyse_as(self.outline.study, self.results)

    def compare(
        self,
        by: str | None = None,
        measure: str = "success",
        *,
        phase: str | None = None,
        reference: str | None = None,
    ) -> Comparison:
        """Compare conditions seed by seed: effect, interval, p, and what could have been detected.

        Parameters
        ----------
        by
            A swept key, or the last part of it: conditions that agree in all others are compared.
            None: all conditions with the first.
        measure
            A measure of episodes, ``steps``, ``return`` or a number of whole trials, by name.
        phase
            Of the episodes; by default ``evaluation``.
        reference
            What the others are compared with; by default the first.

        Raises
        ------
        SpecError
            If there is no such key, measure, phase or reference.
        """
        return Comparison(contrasts(self.results, measure, phase, by, reference))

    def where(self, choice: str) -> StudyResults:
        """Return the trials of a choice, such as ``"robots == 8 and seed < 5"``; see `chosen`."""
        part = chosen(self.results, choice, self._settings)
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
        from ..trials.keeping import finished_trial

        with Store.open(self.directory) as store:
            trial = finished_trial(store, condition, seed)
            recorded = list(trial.recorded.values())
            if episode == "first" and episode not in recorded:
                episode = "last"  # of one episode
            if episode not in recorded:
                raise SpecError(f"episode = {episode!r}: {closest(episode, recorded)}")
            scenario = trial.world()
            if not scenario.draws:
                raise SpecError(f"no replay: {type(scenario).__name__} does not draw its episodes")
            kept = self.directory / "replay" / f"{trial.identity[:8]}-{episode}.gif"
            where = kept if path is None else Path(path)
            if path is None:
                kept.parent.mkdir(exist_ok=True)
            if path is not None or not kept.exists():
                scenario.animate(store.recording(trial.identity, episode), where)
        return Replay(where, f"{trial.condition}, seed {trial.seed}, {episode} episode")

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
        from ..report.page import page  # its templates and packers take their time

        if not self._is_whole:
            raise SpecError("report: is of a whole study, not of a part of it or of another one")
        where = self.directory / "report.html" if path is None else Path(path)
        if where.is_dir() or not where.name:
            raise SpecError(f"--out {where}: is a directory")
        if where.suffix not in (".html", ".htm"):
            raise SpecError(f"--out {where}: suffix must be .html or .htm")
        if not where.parent.is_dir():
            raise SpecError(f"--out {where}: there is no directory {where.parent}")
        durable.write(where, page(self.directory).encode())
        return where

    @property
    def directory(self) -> Path:
        """Where the study is kept.

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
        return f"<h4>{self.outline.study}</h4>{self.table().html}"


def run(
    spec: Spec | Mapping[str, Any] | Place,
    out: Place,
    *,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    retry_failed: bool = False,
    accept_code: bool = False,
    progress: bool = True,
    observer: Observer | None = None,
) -> StudyResults:
    """Run what is left of a study and return its results; the same call again continues it.

    Parameters
    ----------
    spec
        A `Spec`, a table as TOML has it, which may hold objects, or the path of a TOML file.
    out
        Where the study is kept; made if it does not exist. Every trial is kept the moment it
        finishes.
    jobs, backend, address, retry_failed, accept_code
        As those of `nested_agents.studies.api.running.run_study`.
    progress
        Whether to show how it goes.
    observer
        Who is notified of progress instead, see `nested_agents.studies.workers.runner.Observer`.

    Warns
    -----
    UserWarning
        If trials failed; ``study.failed`` has their tracebacks.

    Raises
    ------
    SpecError
        If the study cannot be run or continued; one line says why.
    """
    from ..spec.spec import Spec
    from .running import run_study

    out = Path(out)
    spec = Spec.read(spec, study=out)
    listener = observer or (Terminal() if progress else Observer())
    with run_study(
        spec, out, jobs=jobs, backend=backend, address=address, retry_failed=retry_failed,
        accept_code=accept_code, observer=listener,
    ) as store:  # fmt: skip
        study = _of(store)
    if study.failed and observer is None:
        warnings.warn(
            f"{count(len(study.failed), 'trial')} failed: study.failed says why", stacklevel=2
        )
    return study


def load(*places: Place) -> StudyResults:
    """Return the results of a study that is kept in a directory, or of several together.

    Parameters
    ----------
    *places
        Directories of studies; or single files that ``export --format json`` has written, or of the
        form of marl-eval, as those of BenchMARL are.
        Conditions of several studies whose labels are equal get the name of their directory; the
        first study says how all of them are analysed.

    Raises
    ------
    SpecError
        If there is no readable study, or its rows are damaged; one line says what.
    """
    if not places:
        raise SpecError("load: needs a directory at least")
    paths = [Path(place) for place in places]
    resolved = [path.resolve() for path in paths]
    twice = next((p for i, p in enumerate(paths) if resolved[i] in resolved[:i]), None)
    if twice is not None:
        raise SpecError(f"{twice}: is named more than once")
    loaded = [_loaded(path) for path in paths]
    if len(loaded) == 1:
        return loaded[0]
    names = [path.name for path in paths]
    names = names if len(set(names)) == len(names) else list(map(str, paths))
    results, labels = together(
        [(n, s.results) for n, s in zip(names, loaded, strict=True)],
        [study._settings for study in loaded],
    )
    settings, failed = dict[str, Any](), []
    for study, new in zip(loaded, labels, strict=True):
        settings |= {new[condition]: own for condition, own in study._settings.items()}
        failed += [(new[condition], seed, error) for condition, seed, error in study.failed]
    outline = loaded[0].outline._replace(columns=results.columns)
    return StudyResults(
        outline, results, tuple(failed), tuple(r for s in loaded for r in s.remarks),
        loaded[0]._sources, settings, tuple(d for s in loaded for d in s._directories),
        _is_whole=False,
    )  # fmt: skip


def _loaded(path: Path) -> StudyResults:
    if path.is_file():
        kept = published.load(path)
        remarks = (f"{path}: {kept.note}",) if kept.note else ()
        sources = Sources(brought_by=str(path))
        return StudyResults(kept.outline, kept.results, (), remarks, sources)
    with Store.open(path) as store:
        store.verify()
        return _of(store)


def _of(store: Store) -> StudyResults:
    outline, remark = StudyOutline.kept(store), other_spec(store)
    return StudyResults(
        outline, read(store), tuple(store.failed()), (remark,) if remark else (),
        sources_of(store), store.settings(), (store.directory,),
    )  # fmt: skip
