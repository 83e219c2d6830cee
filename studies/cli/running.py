"""Runs a study for a user at a terminal: progress, table, figures, and where things are."""

from __future__ import annotations

from pathlib import Path

from ...core.protocols import DrawnScenario
from ..analysis.results import Results, read
from ..catalogue.study import load_study
from ..presentation import figures
from ..presentation.tables import tabulate
from ..run import run_study
from ..spec.spec import Spec
from ..store.store import Store
from ..trials.trial import Trial, trials_of
from ..workers.workers import Backend
from . import display


def run_and_show(
    spec: Spec,
    directory: Path,
    *,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    replay: bool = False,
    retry_failed: bool = False,
    accept_code: bool = False,
) -> int:
    """Run what is left of a study, print its table, draw its figures.

    Parameters
    ----------
    spec, directory, jobs, backend, address, retry_failed, accept_code
        As those of `run_study`.
    replay
        Whether to draw a replay of the first condition's first seed.

    Returns
    -------
    int
        1 if any trial failed, else 0.
    """
    with run_study(
        spec,
        directory,
        jobs=jobs,
        backend=backend,
        address=address,
        retry_failed=retry_failed,
        accept_code=accept_code,
        observer=display.Terminal(),
    ) as store:
        failed, results = store.failed(), read(store)
        replays = _replays(store, trials_of(spec)[0]) if replay and not failed else []
    pictures = _show(spec, results, directory / "figures")
    display.print_places(directory, pictures, replays)
    if failed:
        display.say(f"{len(failed)} trials failed: nested-agents status {directory}")
    return 1 if failed else 0


def _show(spec: Spec, results: Results, folder: Path) -> list[Path]:
    """Print the table and the notes of a study; return its figures, drawn into a folder."""
    with spec.sources.active():
        study = load_study(spec.study)
        analysis = study.analyse(results)
        drawn = study.draw(analysis) if analysis.table else {}
    display.print_table(tabulate(analysis.table))
    for note in getattr(analysis, "notes", ()):
        print(note)
    folder.mkdir(exist_ok=True)
    return figures.save(drawn, folder) if drawn else []


def _replays(store: Store, trial: Trial) -> list[Path]:
    """Draw what is recorded of a trial, if its scenario knows how."""
    with trial.sources.active():
        scenario = trial.settings.scenario.build()
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
