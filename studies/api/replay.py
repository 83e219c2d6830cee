"""Recorded episodes of a study, drawn as animations."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import partial
from html import escape
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from ...core.plugins.words import closest
from ..errors import SpecError
from ..results.results import read
from ..store.database import Planned
from ..store.store import Store

FRAME = "<iframe title='{title}' srcdoc='{page}' style='{style}'></iframe>"
"""Style of the page in a notebook."""
STYLE = "width: 100%; height: 42rem; border: 0"
MOST_BYTES = 20_000_000
"""Maximum size of an animation in a notebook [bytes]."""


class Replay(NamedTuple):
    """An animation."""

    path: Path
    """Path of the file."""
    title: str
    """Condition, seed and episode."""
    player: Callable[[], str] = str
    """Returns a page that plays the recorded episodes of the trial; empty where no canvas can."""

    def _repr_html_(self) -> str:
        page = self.player()
        if page:
            return FRAME.format(title=escape(self.title), page=escape(page), style=STYLE)
        content = self.path.read_bytes()
        title = escape(self.title)
        if self.path.suffix != ".gif" or len(content) > MOST_BYTES:
            return f"{title}: {escape(str(self.path))}"
        encoded = base64.b64encode(content).decode("ascii")
        return f"<img alt='{title}' src='data:image/gif;base64,{encoded}'>"


def draw_episode(
    directory: Path,
    condition: str | None,
    seed: int | None,
    episode: str,
    path: str | PathLike[str] | None,
) -> Replay:
    """Draw a recorded episode of the study in a directory, see `StudyResults.replay`.

    Raises
    ------
    SpecError
        If there is no such trial or recording, or its scenario does not draw.
    """
    from ..trials.keeping import finished_trial  # what learns takes its time

    with Store.open(directory) as store:
        trial = finished_trial(store, condition, seed)
        recorded = list(trial.recorded.values())
        if episode == "first" and episode not in recorded:
            episode = "last"  # of one episode
        if episode not in recorded:
            raise SpecError(f"episode = {episode!r}: {closest(episode, recorded)}")
        scenario = trial.world()
        if not scenario.draws:
            raise SpecError(f"no replay: {type(scenario).__name__} does not draw its episodes")
        if path is None:
            drawing = directory / "replay" / f"{trial.identity[:8]}-{episode}.gif"
            drawing.parent.mkdir(exist_ok=True)
        else:
            drawing = Path(path)
        if path is not None or not drawing.exists():
            scenario.animate(store.recording(trial.identity, episode), drawing)
    title = f"{trial.condition}, seed {trial.seed}, {episode} episode"
    is_played = trial.settings.scenario.player
    return Replay(drawing, title, partial(_player, directory, trial.planned) if is_played else str)


def _player(directory: Path, trial: Planned) -> str:
    """Return a page that plays the recorded episodes of a trial."""
    from ..report.page import player_page
    from ..report.replays import replays

    with Store.open(directory) as store:
        return player_page(replays(store, read(store), [trial]))
