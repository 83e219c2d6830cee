"""Conducts a study from its spec to its figures, and tells the user how it goes.

The one place where running, analysis and drawing meet; each of them knows nothing of the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from ... import scenarios
from ...core.protocols import DrawnScenario, Scenario
from ..analysis.results import read
from ..catalogue.study import load_study
from ..presentation import figures
from ..presentation.tables import tabulate
from ..spec.spec import Spec
from ..store.store import Store
from ..trials.trial import Trial, check, trials_of
from ..workers.runner import run_trials
from ..workers.workers import Backend, hire
from . import display


def conduct(
    spec: Spec,
    directory: Path,
    jobs: int | None = None,
    *,
    backend: Backend = "loky",
    address: str | None = None,
    replay: bool = False,
    retry_failed: bool = False,
) -> int:
    """Run what is left of a study, print its table, draw its figures.

    Parameters
    ----------
    spec
        The study.
    directory
        Where it is kept.
    jobs, backend, address
        Who runs the trials, see `hire`.
    replay
        Whether to draw a replay of the first condition's first seed.
    retry_failed
        Whether failed trials are run again.

    Returns
    -------
    int
        1 if any trial failed, else 0.
    """
    with carried_out(
        spec, directory, jobs, backend=backend, address=address, retry_failed=retry_failed
    ) as store:
        failed, results = store.failed(), read(store)
        replays = _replay(store, trials_of(spec)[0]) if replay and not failed else []
    study = load_study(spec.study)
    analysis = study.analyse(results)
    display.print_table(tabulate(analysis.table))
    for note in getattr(analysis, "notes", ()):
        print(note)
    folder = directory / "figures"
    folder.mkdir(exist_ok=True)
    drawn = study.draw(analysis) if analysis.table else {}
    pictures = figures.save(drawn, folder) if drawn else []
    display.print_places(directory, pictures, replays)
    if failed:
        display.say(f"{len(failed)} trials failed: nested-agents status {directory}")
    return 1 if failed else 0


@contextmanager
def carried_out(
    spec: Spec,
    directory: Path,
    jobs: int | None = None,
    *,
    backend: Backend = "loky",
    address: str | None = None,
    retry_failed: bool = False,
) -> Iterator[Store]:
    """Run what is left of a study, and open its store; parameters as those of `conduct`."""
    study, trials = load_study(spec.study), trials_of(spec)
    measures = check(spec)
    getattr(study, "check", lambda spec: None)(spec)
    with (
        hire(backend, jobs, address, len(trials)) as workers,
        Store.create(directory, spec, measures) as store,
    ):
        if retry_failed:
            store.forget_failed()
        pending = store.pending(trials)
        for note in store.notes:
            display.say(note)
        if pending:
            display.announce(spec, directory, workers.processes)
        try:
            with closing(run_trials(pending, store, study.measure, workers)) as outcomes:
                display.follow(outcomes, len(trials), len(trials) - len(pending))
        except KeyboardInterrupt:
            display.say(
                f"interrupted: {store.counts()['done']} of {len(trials)} trials are kept in "
                f"{directory}; the same command continues"
            )
            raise
        yield store


def _replay(store: Store, trial: Trial) -> list[Path]:
    """Draw what is recorded of a trial, if its scenario knows how."""
    scenario: Scenario = scenarios.build(trial.settings.scenario)
    if not isinstance(scenario, DrawnScenario):
        display.say(f"no replay: {type(scenario).__name__} does not draw its episodes")
        return []
    folder = store.directory / "replay"
    folder.mkdir(exist_ok=True)
    paths = []
    for name in ("first", "last"):
        if name not in trial.recorded.values():  # the first of one episode is its last
            continue
        path = folder / f"{name}-episode.gif"
        if not path.exists():
            scenario.animate(store.recording(trial, name), path)
        paths.append(path)
    return paths
