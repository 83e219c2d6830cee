"""The episodes on the page: recordings packed small by those who play them, or drawn as films.

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
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple, Protocol

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

MOST_BYTES = 1_500_000
"""Of all packed episodes together."""


Json = dict[str, Any]
"""An object of JSON."""


class EpisodePlayer(Protocol):
    """A module that plays recordings on a canvas."""

    SCRIPT: Path
    """What draws a packed episode in its scene."""

    def scene_of(self, recording: Recording) -> Json:
        """Return the shapes that a recording is drawn in; raise ValueError if it cannot be."""

    def pack(self, recording: Recording, scene: Json) -> Json:
        """Return a recording as small as can be; its `data` is text."""


class Film(NamedTuple):
    """The last training episode of a trial, drawn by its scenario."""

    condition: str
    seed: int
    data: str
    """A GIF in base64."""


class Replays(NamedTuple):
    """What the page plays."""

    scenes: list[Json]
    """The shapes that episodes are drawn in."""
    episodes: list[Json]
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


def replays(
    store: Store, results: Results, trials: Iterable[Planned], most_bytes: int = MOST_BYTES
) -> Replays:
    """Pack the recordings of finished trials, in their order, until there is no more room.

    Those that no canvas can play are drawn by their scenarios, one for each condition.
    """
    reached = _reached(results)
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
    readable: dict[str, Trial] = {}
    if others:  # else nothing is asked for, and no file of the study's is run
        with suppress(SpecError):  # of another version
            readable = {trial.identity: trial for trial in trials_of(spec_of(store))}
    for condition in dict.fromkeys(trial.condition for trial in others):
        trial = next(trial for trial in others if trial.condition == condition)
        gif = _gif(store, readable[trial.identity]) if trial.identity in readable else ""
        if 0 < len(gif) <= most_bytes - size:
            films.append(Film(trial.condition, trial.seed, gif))
            size += len(gif)
    filmed = {film.condition for film in films}
    if not_drawn := Counter(t.condition for t in others if t.condition not in filmed):
        missing["Not shown, as the scenario cannot draw it, or there is no room"] = not_drawn
    return Replays(scenes, episodes, "".join(scripts), films, missing)


def _gif(store: Store, trial: Trial) -> str:
    """Return the GIF of a trial's last episode in base64; nothing if its scenario cannot draw."""
    scenario = trial.world()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "episode.gif"
        try:
            scenario.animate(store.recording(trial.identity, "last"), path)
        except Exception:  # a drawing may be anybody's, and the page is worth more than it
            return ""
        return base64.b64encode(path.read_bytes()).decode("ascii")


def _scene_of(recording: Recording) -> tuple[EpisodePlayer | None, Json]:
    """Return who plays a recording, and in which scene; none if nobody can."""
    models = [SCENARIOS.model(name) for name in SCENARIOS.built_in]
    names = [model.player for model in models if issubclass(model, ScenarioSettings)]
    for name in dict.fromkeys(filter(None, names)):
        player: EpisodePlayer = resolve_name(name)
        with suppress(ValueError):
            return player, player.scene_of(recording)
    return None, {}


def _reached(results: Results) -> Mapping[tuple[str, int, int], bool]:
    """Return whether each training episode reached the goal, by condition, seed and number.

    Of episodes in many environments at once it is not known.
    """
    training = results.episodes.query("phase == 'training'")
    success = training.set_index(["condition", "seed", "episode"])["success"]
    reached: Mapping[tuple[str, int, int], bool] = success.fillna(False).astype(bool).to_dict()
    return reached
