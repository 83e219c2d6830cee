"""A recorded episode as an animation in a file, which a notebook shows."""

import base64
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.interface.scenario import can_draw
from ...core.plugins.settings import closest
from ..errors import SpecError
from ..store.store import Store

MOST_BYTES = 20_000_000
"""Of an animation that a notebook is given."""


@dataclass(frozen=True)
class Replay:
    """An animation."""

    path: Path
    """Where it is."""
    title: str
    """Condition, seed and episode."""

    def _repr_html_(self) -> str:
        content = self.path.read_bytes()
        if self.path.suffix != ".gif" or len(content) > MOST_BYTES:
            return f"{self.title}: {self.path}"
        encoded = base64.b64encode(content).decode("ascii")
        return f"<img alt='{self.title}' src='data:image/gif;base64,{encoded}'>"


def draw(
    directory: Path, condition: str | None, seed: int | None, episode: str, path: Path | None
) -> Replay:
    """Draw a recorded episode of a trial that has finished.

    Parameters
    ----------
    directory
        Of a study.
    condition, seed
        Which trial; by default the first one.
    episode
        ``first`` or ``last``; ``before`` or ``after`` where something fails.
    path
        Of the animation, GIF or MP4; by default in the folder ``replay`` of the study.

    Raises
    ------
    SpecError
        If there is no such trial or recording, or its scenario does not draw.
    """
    from ..trials.keeping import finished_trial

    with Store.open(directory) as store:
        chosen = finished_trial(store, condition, seed)
        recorded = list(chosen.recorded.values())
        if episode == "first" and episode not in recorded:
            episode = "last"  # of one episode
        if episode not in recorded:
            raise SpecError(f"episode = {episode!r}: {closest(episode, recorded)}")
        scenario: Any = chosen.world()
        if not can_draw(scenario):
            raise SpecError(f"no replay: {type(scenario).__name__} does not draw its episodes")
        is_drawn = False
        if path is None:
            path = directory / "replay" / f"{chosen.identity[:8]}-{episode}.gif"
            path.parent.mkdir(exist_ok=True)
            is_drawn = path.exists()
        if not is_drawn:
            scenario.animate(store.recording(chosen.identity, episode), path)
    return Replay(path, f"{chosen.condition}, seed {chosen.seed}, {episode} episode")
