"""Recorded episodes of a study, drawn as animations."""

from __future__ import annotations

import base64
from html import escape
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from ...core.interface.abilities import Animated
from ...core.plugins.words import closest, show
from ..errors import SpecError
from ..store.store import Store

MOST_BYTES = 20_000_000
"""Maximum size of an animation in a notebook [bytes]."""


class Replay(NamedTuple):
    """An animation."""

    path: Path
    """Path of the file."""
    title: str
    """Condition, seed and episode."""

    def _repr_html_(self) -> str:
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
            raise SpecError(f"episode = {show(episode)}: {closest(episode, recorded)}")
        scenario = trial.world()
        if not isinstance(scenario, Animated):
            raise SpecError(f"no replay: {type(scenario).__name__} does not draw its episodes")
        if path is None:
            drawing = directory / "replay" / f"{trial.identity[:8]}-{episode}.gif"
            drawing.parent.mkdir(exist_ok=True)
        else:
            drawing = Path(path)
        if path is not None or not drawing.exists():
            try:
                scenario.animate(store.recording(trial.identity, episode), drawing)
            except ValueError as error:
                raise SpecError(f"no replay: {error}") from None
    title = f"{trial.condition}, seed {trial.seed}, {episode} episode"
    return Replay(drawing, title)
