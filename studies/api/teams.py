"""Trained teams that a study keeps: ready to act, and evaluated under other hierarchies."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ...core.interface.acting import Actors
from ...core.interface.scenario import Scenario
from ...core.plugins.sources import Sources
from ..errors import SpecError, show
from ..results.results import DONE, read
from ..spec.labels import label
from ..spec.objects import plain
from ..spec.spec import Spec
from ..store.durable import TEAM
from ..store.schema import EVALUATION
from ..store.store import Store
from ..trials.arrangement import check
from ..trials.keeping import finished_trial, open_to_run
from ..trials.session import Session
from ..trials.trial import Trial, TrialResult, trials_of
from ..workers.runner import run_trials
from ..workers.workers import start_workers
from .study import Place, StudyResults
from .study import load as load_study

if TYPE_CHECKING:
    from pandas import DataFrame


def load(directory: Path, condition: str | None, seed: int | None) -> tuple[Scenario, Actors]:
    """Return the world of a trial, and its trained team; see `StudyResults.team`."""
    with Store.open(directory) as store:
        _check_kept(store, ())
        trial = finished_trial(store, condition, seed)
        with trial.sources.active():
            session = Session.restored(trial, store.recording(trial.identity, TEAM))
    return session.scenario, session.team


def reevaluate(
    study: StudyResults | Place,
    topology: Sequence[Any] = (),
    decision: Sequence[Any] = (),
    *,
    jobs: int | None = None,
) -> DataFrame:
    """Evaluate the trained teams of a study under other topologies and ways to decide.

    Every team acts with its weights on the worlds of its own evaluation, and begins with the random
    numbers that it began that one with: under what it was trained with, it does the same again.
    Files of yours that the study keeps are taken as it keeps them.

    Parameters
    ----------
    study
        What `load` or `run` returned, or a part of it by ``where``; or the directory of a study
        that keeps its teams (``keep_teams = true``).
    topology
        Topologies, as a spec has them: text, or a table laid over that of training.
    decision
        Tables laid over ``learner.decision`` of training. If both are given, each of these is
        evaluated with each topology.
    jobs
        Processes; None: one for every core.

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
    study = study if isinstance(study, StudyResults) else load_study(study)
    done = study.trials[study.trials["state"] == DONE]
    identities = {(row.condition, row.seed): str(row.identity) for row in done.itertuples()}
    directory = study.directory.resolve()
    with Store.open(directory) as store:
        _check_kept(store, {*identities.values()})
        table = {**store.spec(), "evaluations": _entries(topology, decision), "keep_teams": False}
        sources = Sources(Path(), store.sources(), brought_by=str(directory))
    spec = Spec.of(table, sources)
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: reevaluate needs a study of 1 or more")
    measures = check(spec, {condition for condition, _ in identities})
    trials = [t for t in trials_of(spec) if (t.condition, t.seed) in identities]
    with (
        TemporaryDirectory() as folder,
        start_workers("loky", jobs, None, len(trials)) as workers,
        open_to_run(Path(folder), spec, trials, measures) as store,
    ):
        evaluate = partial(_evaluate, directory, identities)
        for outcome in run_trials(trials, store, evaluate, workers):
            if outcome.error is not None:
                where = f"{outcome.trial.condition}, seed {outcome.trial.seed}"
                raise SpecError(f"{where}: {outcome.error.splitlines()[-1]}")
        frame = read(store).episodes
    frame.insert(0, "entry", frame["phase"].str.removeprefix(EVALUATION))
    meaning = "topology and decision by which the trained team acts"
    frame.attrs["columns"]["entry"] = {"unit": "", "meaning": meaning}
    return frame


def _check_kept(store: Store, identities: Container[str]) -> None:
    """Refuse a study that keeps no teams, or not those of some trials as they were written."""
    if not store.spec().get("keep_teams"):
        raise SpecError(f"{store.directory}: keeps no teams: its spec has no keep_teams = true")
    for identity, line in store.damage().items():
        if identity in identities:
            raise SpecError(f"{line}; nested-agents run runs it again")


def _entries(topology: Sequence[Any], decision: Sequence[Any]) -> dict[str, dict[str, Any]]:
    """Return the table of ``[evaluations]``, by what tells its entries apart."""
    lists = {"topology": topology, "decision": decision}
    for key, values in lists.items():
        if not isinstance(values, list | tuple):
            raise SpecError(f"{key} = {show(values)}: must be a list")
    lists = {key: plain(values, key) for key, values in lists.items() if values}
    entries: dict[str, dict[str, Any]] = {}
    for values in product(*lists.values()):
        point = dict(zip(lists, values, strict=True))
        name = label(point)
        if not point or name in entries:
            given = f"topology = {show(topology)}, decision = {show(decision)}"
            raise SpecError(f"{given}: must be lists of distinct values, one of them not empty")
        if "decision" in point:
            point["learner"] = {"decision": point.pop("decision")}
        entries[name] = point
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
