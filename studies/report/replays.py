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
from typing import Any

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


def replays(
    store: Store, results: Results, trials: Iterable[Planned], max_bytes: int = MAX_BYTES
) -> Json:
    """Pack the recordings of finished trials in order, up to a maximum size.

    Recordings without a player are shown as animations, one for each condition.

    Returns
    -------
    dict
        ``scenes``, the fixed shapes of episodes; packed ``episodes`` with the index of their
        scene; ``script``, which draws them; ``films``, the animations of other scenarios; and
        ``remarks``, a sentence for each reason why trials are not shown.
    """
    reached = _training_successes(results)
    done = {key[:2] for key in reached}
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
    filmed = {film["condition"] for film in films}
    if not_drawn := Counter(t.condition for t in others if t.condition not in filmed):
        missing["Not shown because the scenario cannot draw it, or the page is full"] = not_drawn
    remarks = [f"{reason}: {_seeds_of(counts)}." for reason, counts in missing.items()]
    return {
        "scenes": scenes,
        "episodes": episodes,
        "script": "".join(scripts),
        "films": films,
        "remarks": remarks,
    }


def _seeds_of(counts: Mapping[str, int]) -> str:
    """Return the names of conditions, each with its number of seeds."""
    return ", ".join(f"{name} ({count(number, 'seed')})" for name, number in counts.items())


def _films(store: Store, planned: Sequence[Planned], max_bytes: int) -> list[Json]:
    """Return an animation for the first trial of each condition, up to a maximum size."""
    films = list[Json]()
    trials: dict[str, Trial] = {}
    if planned:
        with suppress(SpecError):  # a study of another version
            trials = {trial.identity: trial for trial in trials_of(spec_of(store))}
    shown = set[str]()
    for trial in planned:
        if trial.condition not in shown:
            shown.add(trial.condition)
            gif = _gif(store, trials[trial.identity]) if trial.identity in trials else ""
            if 0 < len(gif) <= max_bytes:
                films.append({"condition": trial.condition, "seed": trial.seed, "data": gif})
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


def _scene_of(recording: Recording) -> tuple[Any, Json]:
    """Return the module that plays a recording, see above, and its scene; None without one."""
    models = [SCENARIOS.model(name) for name in SCENARIOS.built_in]
    names = [model.player for model in models if issubclass(model, ScenarioSettings)]
    for name in dict.fromkeys(filter(None, names)):
        player = resolve_name(name)
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
