"""Recorded episodes in a report: played on a canvas, or shown as animations.

Settings of a scenario can name a `player`, which plays recordings on a canvas. It is a module with
``scene_of(recording)``, which raises ValueError if it cannot play the recording,
``pack(recording, scene)``, and the path ``SCRIPT`` of a script that draws packed episodes. For
other scenarios that draw their episodes, the report shows one animation for each condition.
"""

import base64
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple, Protocol

from ...core.interface.abilities import Animated
from ...core.plugins.settings import ScenarioSettings
from ...scenarios import SCENARIOS
from ..errors import SpecError
from ..presentation.progress import count
from ..results.results import Results
from ..store.database import Planned
from ..store.durable import NotRecordedError, Recording
from ..store.store import Store
from ..trials.keeping import spec_of
from ..trials.trial import Trial, trials_of

MAX_BYTES = 1_500_000
"""Maximum size of all packed episodes together."""


Json = dict[str, Any]
"""An object of JSON."""


class EpisodePlayer(Protocol):
    """A module that plays recordings on a canvas."""

    SCRIPT: Path
    """Path of the script that draws packed episodes."""

    def scene_of(self, recording: Recording) -> Json:
        """Return the fixed shapes of a recording; raise ValueError if it cannot be played."""

    def pack(self, recording: Recording, scene: Json) -> Json:
        """Return a recording as compact JSON with its `data` as text."""


class Film(NamedTuple):
    """The last training episode of a trial, drawn by its scenario."""

    condition: str
    seed: int
    data: str
    """A GIF in base64."""


class Replays(NamedTuple):
    """Recorded episodes of a page."""

    scenes: list[Json]
    """Fixed shapes of episodes."""
    episodes: list[Json]
    """Packed episodes; `scene` is an index into `scenes`."""
    script: str
    """Script that draws the episodes; empty without episodes."""
    films: list[Film]
    """Animations of other scenarios."""
    missing: dict[str, Counter[str]]
    """Numbers of finished trials that are not shown, by reason and condition."""

    @property
    def remarks(self) -> list[str]:
        """A sentence for each reason why trials are not shown."""
        sentences = []
        for reason, trials in self.missing.items():
            parts = [f"{name} ({count(number, 'seed')})" for name, number in trials.items()]
            sentences.append(f"{reason}: {', '.join(parts)}.")
        return sentences


def replays(
    store: Store, results: Results, trials: Iterable[Planned], max_bytes: int = MAX_BYTES
) -> Replays:
    """Pack the recordings of finished trials in order, up to a maximum size.

    Recordings without a player are shown as animations, one for each condition.
    """
    reached = _training_successes(results)
    done = {(condition, seed) for condition, seed, _ in reached}
    scenes = list[Json]()
    episodes = list[Json]()
    scripts = set[str]()
    others = list[Planned]()
    size = 0
    missing: defaultdict[str, Counter[str]] = defaultdict(Counter)

    for trial in trials:
        if (trial.condition, trial.seed) not in done:
            continue
        if size >= max_bytes:
            missing["Left out to keep the page small"][trial.condition] += 1
            continue
        try:
            kept = {k: store.recording(trial.identity, name) for k, name in trial.recorded.items()}
        except NotRecordedError:
            missing["Not shown because the scenario records no episodes"][trial.condition] += 1
            continue
        except SpecError:
            missing["Not shown because the recording is missing or damaged"][trial.condition] += 1
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
                "number": number,
                "reached": reached[trial.condition, trial.seed, number],
                "scene": scenes.index(scene),
                **player.pack(recording, scene),
            }
            episodes.append(episode)
            scripts.add(player.SCRIPT.read_text(encoding="utf-8"))
            size += len(episode["data"])
    films = _films(store, others, max_bytes - size)
    filmed = {film.condition for film in films}
    if not_drawn := Counter(t.condition for t in others if t.condition not in filmed):
        missing["Not shown because the scenario cannot draw it, or the page is full"] = not_drawn
    return Replays(scenes, episodes, "".join(scripts), films, missing)


def _films(store: Store, planned: Sequence[Planned], max_bytes: int) -> list[Film]:
    """Return an animation for the first trial of each condition, up to a maximum size."""
    films: list[Film] = []
    if not planned:
        return films
    trials: dict[str, Trial] = {}
    with suppress(SpecError):  # a study of another version
        trials = {trial.identity: trial for trial in trials_of(spec_of(store))}
    first = {trial.condition: trial for trial in reversed(planned)}
    for condition in dict.fromkeys(trial.condition for trial in planned):
        trial = first[condition]
        gif = _gif(store, trials[trial.identity]) if trial.identity in trials else ""
        if 0 < len(gif) <= max_bytes:
            films.append(Film(condition, trial.seed, gif))
            max_bytes -= len(gif)
    return films


def _gif(store: Store, trial: Trial) -> str:
    """Return the last episode of a trial as a GIF in base64; empty if it cannot be drawn."""
    scenario = trial.world()
    if not isinstance(scenario, Animated):
        return ""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "episode.gif"
        try:
            scenario.animate(store.recording(trial.identity, "last"), path)
        except Exception:  # a failing drawing of a user must not prevent the report
            return ""
        return base64.b64encode(path.read_bytes()).decode("ascii")


def _scene_of(recording: Recording) -> tuple[EpisodePlayer | None, Json]:
    """Return the player of a recording and its scene; None without a player."""
    models = [SCENARIOS.model(name) for name in SCENARIOS.built_in]
    names = [model.player for model in models if issubclass(model, ScenarioSettings)]
    for name in dict.fromkeys(filter(None, names)):
        player: EpisodePlayer = resolve_name(name)
        with suppress(ValueError):
            return player, player.scene_of(recording)
    return None, {}


def _training_successes(results: Results) -> Mapping[tuple[str, int, int], bool]:
    """Return whether each training episode succeeded, by condition, seed and number.

    Episodes in many parallel environments count as failures, because their success is unknown.
    """
    training = results.episodes.query("phase == 'training'")
    success = training.set_index(["condition", "seed", "episode"])["success"]
    reached: Mapping[tuple[str, int, int], bool] = success.fillna(False).astype(bool).to_dict()
    return reached
