"""Recorded episodes as animations, where the canvas of a report cannot play them.

Any scenario without a player that draws its episodes, one's own included, has them drawn as it does
itself (`can_draw`).
"""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.interface.scenario import can_draw
from ..errors import SpecError
from ..store.store import Planned, Store
from ..trials.keeping import spec_of
from ..trials.trial import Trial, trials_of

LAST = "last"
"""The recorded episode that is drawn."""


@dataclass(frozen=True)
class Film:
    """The last training episode of a trial."""

    condition: str
    """The condition of its trial."""
    seed: int
    """The seed of its trial."""
    data: str
    """A GIF in base64."""


def films(store: Store, planned: Iterable[Planned], most_bytes: int) -> list[Film]:
    """Draw the first of the given trials of each condition, until there is no more room."""
    drawn: list[Film] = []
    first: dict[str, str] = {}
    for plan in planned:
        first.setdefault(plan.condition, plan.identity)
    # Of a study that the canvas plays nothing is asked for, and no file of its is run.
    trials = _trials(store) if first else {}
    for identity in first.values():
        if identity not in trials:
            continue
        trial = trials[identity]
        encoded = base64.b64encode(_drawn(store, trial)).decode("ascii")
        if not 0 < len(encoded) <= most_bytes:
            continue
        most_bytes -= len(encoded)
        drawn.append(Film(trial.condition, trial.seed, encoded))
    return drawn


def _trials(store: Store) -> Mapping[str, Trial]:
    """Return the trials of a study by identity; none if this version cannot read its spec."""
    try:
        return {trial.identity: trial for trial in trials_of(spec_of(store))}
    except SpecError:
        return {}


def _drawn(store: Store, trial: Trial) -> bytes:
    """Return the GIF of a trial's last episode; nothing if its scenario cannot."""
    scenario: Any = trial.world()
    if not can_draw(scenario) or LAST not in trial.recorded.values():
        return b""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "episode.gif"
        try:
            scenario.animate(store.recording(trial.identity, LAST), path)
        except Exception:  # a drawing may be anybody's, and the page is worth more than it
            return b""
        return path.read_bytes()
