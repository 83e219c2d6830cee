"""Trained teams that a study keeps, and their evaluation without training."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, Self

from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ..errors import SpecError, exception_line
from ..presentation.progress import Terminal
from ..results.results import DONE, Results, read
from ..spec.spec import Spec
from ..spec.tables import SpecTable
from ..store.durable import TEAM
from ..store.store import Store
from ..trials.arrangement import check_conditions
from ..trials.keeping import check_teams, open_to_run
from ..trials.session import Session
from ..trials.trial import Trial, TrialResult, trials_of
from ..workers.runner import Observer, Outcome, run_trials
from ..workers.workers import start_workers


class KeptTeams(NamedTuple):
    """Trained teams of the finished trials of a study that keeps its teams."""

    directory: Path
    identities: Mapping[tuple[str, int], str]
    """Identities of the trials by condition and seed."""
    spec: Spec
    """Spec of the study with its changes."""

    @classmethod
    def of(cls, directory: Path, trials: pd.DataFrame, changes: SpecTable) -> Self:
        """Return the teams of trials.

        Parameters
        ----------
        directory
            Directory of the study.
        trials
            The trials, see `Results.trials`.
        changes
            Changes of the spec, such as its further evaluations.

        Raises
        ------
        SpecError
            If the study keeps no teams, or has no evaluation; one line.
        """
        done = trials[trials["state"] == DONE]
        identities = {(row.condition, row.seed): str(row.identity) for row in done.itertuples()}
        directory = directory.resolve()
        with Store.open(directory) as store:
            check_teams(store, {*identities.values()})
            table = {**store.spec(), **changes, "keep_teams": False}
            sources = Sources(Path(), store.sources(), brought_by=str(directory))
        spec = Spec.of(table, sources)
        if spec.evaluation < 1:
            raise SpecError("evaluation = 0: kept teams are evaluated in a study of 1 or more")
        return cls(directory, identities, spec)

    @property
    def conditions(self) -> set[str]:
        """Labels of the conditions of the teams."""
        return {condition for condition, _ in self.identities}

    @property
    def trials(self) -> list[Trial]:
        """The trials of the teams, with the further evaluations of the spec."""
        return [t for t in trials_of(self.spec) if (t.condition, t.seed) in self.identities]

    def evaluate(
        self, trials: Sequence[Trial], task: str, jobs: int | None, observer: Observer | None
    ) -> Results:
        """Evaluate the teams of trials in the further evaluations of the trials.

        The observer is notified of the task first.

        Raises
        ------
        SpecError
            If a team cannot act in an evaluation; one line.
        """
        measures = check_conditions(self.spec, self.conditions)
        observer = observer or Terminal()
        observer.note(task)
        with (
            TemporaryDirectory() as folder,
            start_workers("loky", jobs, None, len(trials)) as workers,
            open_to_run(Path(folder), self.spec, trials, measures) as store,
        ):
            evaluate = partial(_evaluate, self.directory, self.identities)
            outcomes = _succeeding(run_trials(trials, store, evaluate, workers))
            observer.follow(outcomes, len(trials), 0)
            return read(store)


def _succeeding(outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """Yield outcomes until one is a failure."""
    for outcome in outcomes:
        if outcome.error is not None:
            where = f"{outcome.trial.condition}, seed {outcome.trial.seed}"
            raise SpecError(f"{where}: {exception_line(outcome.error)}")
        yield outcome


def _evaluate(
    directory: Path, identities: Mapping[tuple[str, int], str], trial: Trial
) -> TrialResult:
    """Evaluate the kept team of a trial in its `evaluations`; imported by name in workers."""
    with Store.open(directory) as store:
        arrays = store.recording(identities[trial.condition, trial.seed], TEAM)
    session = Session.restored(trial, arrays)
    session.run_other_evaluations()
    return session.result()
