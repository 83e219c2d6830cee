"""Recorded episodes for a report, packed small by those who play them on a page.

A scenario whose settings name a `player` has its recordings played on a canvas. The player is a
module with ``scene_of(recording)``, which raises ValueError if it cannot play it, with
``pack(recording, scene)``, and the path ``SCRIPT`` of what draws a packed episode in its scene.
Any other that draws its episodes, one's own included, has them drawn as animations, one for each
condition.
"""

import base64
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple

from ...scenarios import SCENARIOS
from ..errors import SpecError
from ..presentation.words import count
from ..results.results import read
from ..store.durable import NotRecordedError, Recording
from ..store.schema import Planned
from ..store.store import Store
from ..trials.keeping import spec_of
from ..trials.trial import Trial, trials_of

MOST_BYTES = 1_500_000
"""Of all packed episodes together."""


class Film(NamedTuple):
    """The last training episode of a trial, drawn by its scenario."""

    condition: str
    seed: int
    data: str
    """A GIF in base64."""


@dataclass(frozen=True)
class Replays:
    """What the page plays."""

    scenes: list[dict[str, Any]]
    """The shapes that episodes are drawn in."""
    episodes: list[dict[str, Any]]
    """The packed episodes; `scene` is an index into `scenes`."""
    script: str
    """What draws them; empty if there are none."""
    films: list[Film]
    """Episodes that other scenarios draw themselves."""
    missing: dict[str, Counter[str]]
    """How many finished trials are not shown, by condition, by reason."""

    @property
    def remarks(self) -> list[str]:
        """What is missing, in words: a sentence for every reason."""
        sentences = []
        for reason, trials in self.missing.items():
            parts = [f"{name} ({count(number, 'seed')})" for name, number in trials.items()]
            sentences.append(f"{reason}: {', '.join(parts)}.")
        return sentences


def replays(store: Store, trials: Iterable[Planned], most_bytes: int = MOST_BYTES) -> Replays:
    """Pack the recordings of finished trials, in their order, until there is no more room.

    Those that no canvas can play are drawn by their scenarios, one for each condition.
    """
    reached = _reached(store)
    done = {(condition, seed) for condition, seed, _ in reached}
    scenes: list[dict[str, Any]] = []
    episodes: list[dict[str, Any]] = []
    missing: defaultdict[str, Counter[str]] = defaultdict(Counter)
    scripts: set[str] = set()
    others: list[Planned] = []
    size = 0

    for trial in trials:
        if (trial.condition, trial.seed) not in done:
            continue
        if size >= most_bytes:
            missing["Left out to keep the page small"][trial.condition] += 1
            continue
        try:
            kept = {k: store.recording(trial.identity, name) for k, name in trial.recorded.items()}
        except NotRecordedError:
            missing["Not shown, as the scenario records no episodes"][trial.condition] += 1
            continue
        except SpecError:
            missing["Not shown, as the recording is missing or damaged"][trial.condition] += 1
            continue
        for number, recording in kept.items():
            player, scene = _scene_of(recording)
            if player is None:
                others.append(trial)
                break
            if scene not in scenes:
                scenes.append(scene)
            episode = {
                "condition": trial.condition,
                "seed": trial.seed,
                "number": number + 1,
                "reached": reached[trial.condition, trial.seed, number],
                "scene": scenes.index(scene),
                **player.pack(recording, scene),
            }
            episodes.append(episode)
            scripts.add(player.SCRIPT.read_text(encoding="utf-8"))
            size += len(episode["data"])
    films: list[Film] = []
    # Of a study that the canvas plays nothing is asked for, and no file of its is run.
    readable = _trials(store) if others else {}
    first: dict[str, Planned] = {}
    for trial in others:
        first.setdefault(trial.condition, trial)
    for trial in first.values():
        gif = _drawn(store, readable[trial.identity]) if trial.identity in readable else ""
        if 0 < len(gif) <= most_bytes - size:
            films.append(Film(trial.condition, trial.seed, gif))
            size += len(gif)
    filmed = {film.condition for film in films}
    missing["Not shown, as the scenario cannot draw it, or there is no room"] += Counter(
        trial.condition for trial in others if trial.condition not in filmed
    )
    kept_back = {reason: trials for reason, trials in missing.items() if trials}
    return Replays(scenes, episodes, "".join(scripts), films, kept_back)


def _trials(store: Store) -> Mapping[str, Trial]:
    """Return the trials of a study by identity; none if this version cannot read its spec."""
    try:
        return {trial.identity: trial for trial in trials_of(spec_of(store))}
    except SpecError:
        return {}


def _drawn(store: Store, trial: Trial) -> str:
    """Return the GIF of a trial's last episode in base64; nothing if its scenario cannot draw."""
    scenario: Any = trial.world()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "episode.gif"
        try:
            scenario.animate(store.recording(trial.identity, "last"), path)
        except Exception:  # a drawing may be anybody's, and the page is worth more than it
            return ""
        return base64.b64encode(path.read_bytes()).decode("ascii")


def _scene_of(recording: Recording) -> tuple[Any, dict[str, Any]]:
    """Return who plays a recording, and in which scene; none if nobody can."""
    for player in _players():
        with suppress(ValueError):
            return player, player.scene_of(recording)
    return None, {}


@cache
def _players() -> tuple[Any, ...]:
    """Return the players of the built-in scenarios."""
    models: list[Any] = [SCENARIOS.model(name) for name in SCENARIOS.built_in]
    return tuple(map(resolve_name, dict.fromkeys(m.player for m in models if m.player)))


def _reached(store: Store) -> Mapping[tuple[str, int, int], bool]:
    """Return whether each training episode reached the goal, by condition, seed and number."""
    training = read(store).episodes.query("phase == 'training'")
    success: Any = training.set_index(["condition", "seed", "episode"])["success"]
    return {key: bool(reached) for key, reached in success.items()}
