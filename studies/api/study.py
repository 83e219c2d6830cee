"""Results of a study and its folder: replays, trained teams, explanations and reports.

Everything is computed on demand from the content of the folder.

Examples
--------
>>> import tempfile
>>> from nested_agents.studies.api.running import run
>>> out = tempfile.mkdtemp()
>>> spec = {"seeds": 2, "episodes": 1, "steps": 2, "evaluation": 1, "preset": "random"}
>>> study = run(spec, out, jobs=1, progress=False)
>>> study.conditions, study.table(["training success"]).titles
(('random',), ('training success',))
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

from ..errors import SpecError
from ..results.results import read
from ..spec.outline import StudyOutline, older_results, other_spec, sources_of
from ..store import durable
from ..store.store import Store
from .data import Place, StudyData
from .replay import Replay, draw_episode
from .status import Status

if TYPE_CHECKING:
    from ...core.agents.team import Team
    from ...core.interface.scenario import Scenario
    from ..resilience.report import ResilienceReport
    from ..workers.runner import Observer
    from .explaining import TeamExplanation


class StudyResults(StudyData):
    """Results of the finished trials of one or several studies, and access to their folder.

    Made by `run` and `load`. Printed, or shown by a notebook, it is its table.
    """

    @classmethod
    def of(cls, store: Store) -> Self:
        """Return the results of an open study."""
        results, failed = read(store), tuple(store.failed())
        lost = dict.fromkeys(c for c, *_ in failed if c not in results.conditions)
        remarks = (
            older_results(store),
            None if store.is_older else other_spec(store),
            f"no results, because trials failed: {'; '.join(lost)}" if lost else None,
        )
        return cls(
            outline=StudyOutline.kept(store),
            results=results,
            failed=failed,
            remarks=tuple(remark for remark in remarks if remark is not None),
            _sources=sources_of(store),
            _settings=store.settings(),
            _directories=(store.directory,),
        )

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
        """Draw a recorded episode of a trial as an animation, which a notebook shows.

        Parameters
        ----------
        condition, seed
            The trial; by default the first.
        episode
            ``first`` or ``last``; with failures also ``before`` or ``after``.
        path
            GIF or MP4 file to write; by default in the folder ``replay`` of the study.

        Raises
        ------
        SpecError
            If there is no such trial or recording, or its scenario does not draw.
        """
        return draw_episode(self.directory, condition, seed, episode, path)

    def team(self, condition: str | None = None, seed: int | None = None) -> tuple[Scenario, Team]:
        """Return the scenario of a trial and its trained team.

        Parameters
        ----------
        condition, seed
            The trial; by default the first.

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
        """Explain a trained team: its rules in words and its self-model.

        If the study does not keep its teams, the training is repeated and must give the same
        episodes.

        Parameters
        ----------
        condition, seed
            The trial; by default the first.

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
            Path of the file; by default ``report.html`` in the folder of the study.

        Raises
        ------
        SpecError
            If the path is no HTML file, or these are not the results of one whole study.
        """
        from ..report.page import check_path, page  # its templates and packers take their time

        if not self._is_whole:
            raise SpecError("report: needs a whole study, not a part of it or another analysis")
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
