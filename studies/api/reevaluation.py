"""Teams that a study keeps, evaluated under other hierarchies and ways to decide."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import show
from ..errors import SpecError
from ..presentation.progress import Terminal
from ..results.results import DONE, read
from ..spec.objects import plain
from ..spec.spec import Spec
from ..spec.tables import TomlTable, label
from ..store.database import EVALUATION
from ..store.durable import TEAM
from ..store.store import Store
from ..trials.arrangement import check_conditions
from ..trials.keeping import check_teams, open_to_run
from ..trials.session import Session
from ..trials.trial import Trial, TrialResult, trials_of
from ..workers.runner import Observer, Outcome, run_trials
from ..workers.workers import start_workers
from .loading import load
from .study import Place, StudyResults


def reevaluate(
    study: StudyResults | Place,
    topology: Sequence[object] = (),
    decision: Sequence[object] = (),
    *,
    jobs: int | None = None,
    observer: Observer | None = None,
) -> pd.DataFrame:
    """Evaluate the trained teams of a study under other topologies and ways to decide.

    Every team acts with its weights on the worlds of its own evaluation, and begins with the random
    numbers that it began that one with: under what it was trained with, it does the same again.
    User files are read from the copies that the study keeps.

    Parameters
    ----------
    study
        What `load` or `run` returned, or a part of it by ``where``; or the directory of a study
        that keeps its teams (``keep_teams = true``).
    topology
        Topologies as in a spec: text, or a table that overrides that of training.
    decision
        Tables that override ``learner.decision`` of training. If both are given, each of these is
        evaluated with each topology.
    jobs
        Processes; None: one for every core.
    observer
        Is notified of the progress; None: it is shown on standard error.

    Returns
    -------
    DataFrame
        A row per episode as in `StudyResults.episodes`, with a column `entry`: which of the
        topologies and decisions it is of.

    Raises
    ------
    SpecError
        If there are no such teams, or they cannot act so; one line.
    """
    study = study if isinstance(study, StudyResults) else load(study)
    done = study.trials[study.trials["state"] == DONE]
    identities = {(row.condition, row.seed): str(row.identity) for row in done.itertuples()}
    directory = study.directory.resolve()
    with Store.open(directory) as store:
        check_teams(store, {*identities.values()})
        table = {**store.spec(), "evaluations": _entries(topology, decision), "keep_teams": False}
        sources = Sources(Path(), store.sources(), brought_by=str(directory))
    spec = Spec.of(table, sources)
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: reevaluate needs a study of 1 or more")
    measures = check_conditions(spec, {condition for condition, _ in identities})
    trials = [t for t in trials_of(spec) if (t.condition, t.seed) in identities]
    with (
        TemporaryDirectory() as folder,
        start_workers("loky", jobs, None, len(trials)) as workers,
        open_to_run(Path(folder), spec, trials, measures) as store,
    ):
        evaluate = partial(_evaluate, directory, identities)
        outcomes = _succeeding(run_trials(trials, store, evaluate, workers))
        (observer or Terminal()).follow(outcomes, len(trials), 0)
        frame = read(store).episodes
    frame.insert(0, "entry", frame["phase"].str.removeprefix(EVALUATION))
    meaning = "topology and decision by which the trained team acts"
    frame.attrs["columns"]["entry"] = {"unit": "", "meaning": meaning}
    return frame


def _succeeding(outcomes: Iterable[Outcome]) -> Iterator[Outcome]:
    """Yield outcomes until one is a failure."""
    for outcome in outcomes:
        if outcome.error is not None:
            where = f"{outcome.trial.condition}, seed {outcome.trial.seed}"
            raise SpecError(f"{where}: {outcome.error.splitlines()[-1]}")
        yield outcome


def _entries(topology: Sequence[object], decision: Sequence[object]) -> dict[str, TomlTable]:
    """Return the table of ``[evaluations]``, by what tells its entries apart."""
    given = {"topology": topology, "decision": decision}
    lists = {key: plain(values, key) for key, values in given.items() if values}
    if not lists or not all(isinstance(values, list | tuple) for values in lists.values()):
        requested = ", ".join(f"{key} = {show(values)}" for key, values in given.items())
        raise SpecError(f"{requested}: must be lists, one of them not empty")
    entries = dict[str, TomlTable]()
    for values in product(*lists.values()):
        entry: TomlTable = dict(zip(lists, values, strict=True))
        name = label(entry)
        if "decision" in entry:
            entry["learner"] = {"decision": entry.pop("decision")}
        entries[name] = entry
    return entries


def _evaluate(
    directory: Path, identities: Mapping[tuple[str, int], str], trial: Trial
) -> TrialResult:
    """Evaluate the kept team of a trial in its `evaluations`; imported by name in workers."""
    with Store.open(directory) as store:
        arrays = store.recording(identities[trial.condition, trial.seed], TEAM)
    session = Session.restored(trial, arrays)
    session.run_other_evaluations()
    return session.result()
