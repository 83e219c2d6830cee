"""Runs a study for a user at a terminal: progress, table, figures, and where things are."""

from __future__ import annotations

from pathlib import Path

from ..api.study import StudyResults, run
from ..presentation.progress import Terminal, say
from ..presentation.words import count
from ..spec.errors import SpecError
from ..spec.spec import Spec
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
    formats: tuple[str, ...] = (),
    loggers: tuple[str, ...] = (),
) -> int:
    """Run what is left of a study, print its table, draw its figures.

    Parameters
    ----------
    spec, directory, jobs, backend, address, retry_failed, accept_code, loggers
        As those of `run_study`.
    replay
        Whether to draw a replay of the first condition's first seed.
    formats
        Of the figures; none: PNG and SVG.

    Returns
    -------
    int
        1 if any trial failed, else 0.
    """
    study = run(
        spec, directory, jobs=jobs, backend=backend, address=address, retry_failed=retry_failed,
        accept_code=accept_code, observer=Terminal(), loggers=loggers,
    )  # fmt: skip
    from ..presentation import figures  # Matplotlib takes its time, for which no trial has to wait

    replays = _replays(study, spec.episodes) if replay and not study.failed else []
    display.print_study(study)
    folder = directory / "figures"
    folder.mkdir(exist_ok=True)
    drawn = figures.save(study.figures, folder, formats or figures.USUAL)
    display.print_places(directory, drawn, replays)
    if study.failed:
        say(f"{count(len(study.failed), 'trial')} failed: nested-agents status {directory}")
    return 1 if study.failed else 0


def _replays(study: StudyResults, episodes: int) -> list[Path]:
    """Draw once what is recorded of the first trial, if its scenario knows how."""
    folder = study.directory / "replay"
    names = ("first", "last") if episodes > 1 else ("last",)
    paths = {name: folder / f"{name}-episode.gif" for name in names}
    try:
        folder.mkdir(exist_ok=True)
        for name, path in paths.items():
            if not path.exists():
                study.replay(episode=name, path=path)
    except SpecError as error:
        say(str(error))
        return []
    return list(paths.values())
