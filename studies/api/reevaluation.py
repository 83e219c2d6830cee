"""Teams that a study keeps, evaluated under other hierarchies and ways to decide."""

from collections.abc import Sequence
from itertools import product

from ...core.numerics import pd
from ...core.plugins.words import show
from ..errors import SpecError
from ..presentation.progress import count
from ..spec.objects import plain
from ..spec.tables import TomlTable, label
from ..store.database import EVALUATION
from ..workers.runner import Observer
from .data import Place
from .kept_teams import KeptTeams
from .loading import load
from .study import StudyResults


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
    changes = {"evaluations": _entries(topology, decision)}
    kept = KeptTeams.of(study.directory, study.trials, changes)
    task = f"{count(len(changes['evaluations']), 'evaluation')} of each trained team"
    frame = kept.evaluate(kept.trials, task, jobs, observer).episodes
    frame.insert(0, "entry", frame["phase"].str.removeprefix(EVALUATION))
    meaning = "topology and decision by which the trained team acts"
    frame.attrs["columns"]["entry"] = {"unit": "", "meaning": meaning}
    return frame


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
