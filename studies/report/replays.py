"""Recorded episodes for a report, packed small by those who play them on a page.

A scenario whose settings name a `player` has its recordings played on a canvas. The player is a
module with ``scene_of(recording)``, which raises ValueError if it cannot play it, with
``pack(recording, scene)``, and the path ``SCRIPT`` of what draws a packed episode in its scene.
Other scenarios draw theirs as `films`.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any

from ...core.plugins.deferred import located
from ...scenarios import SCENARIOS
from ..errors import SpecError
from ..presentation.words import count
from ..store.durable import NotRecordedError, Recording
from ..store.store import Planned, Store
from .films import Film, films

MOST_BYTES = 1_500_000
"""Of all packed episodes together."""


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
    drawn = films(store, others, most_bytes - size)
    filmed = {film.condition for film in drawn}
    for trial in others:
        if trial.condition not in filmed:
            missing["Not shown, as the scenario cannot draw it, or there is no room"][
                trial.condition
            ] += 1
    return Replays(scenes, episodes, "".join(scripts), drawn, missing)


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
    return tuple(map(located, dict.fromkeys(m.player for m in models if m.player)))


def _reached(store: Store) -> Mapping[tuple[str, int, int], bool]:
    """Return whether each training episode reached the goal, by condition, seed and number."""
    names, rows = store.rows("training")
    at = [names.index(name) for name in ("condition", "seed", "episode", "success")]
    return {(row[at[0]], row[at[1]], row[at[2]]): bool(row[at[3]]) for row in rows}
