"""The recording of an episode, step by step."""

from typing import Any

import numpy as np

from ..numerics import FloatArray
from .abilities import Animated, Recorded
from .scenario import Transition


class EpisodeRecorder:
    """Collects the recording of one episode.

    Parameters
    ----------
    scenario
        Scenario in the state before the first step. It may be another instance than the one that
        steps, in the same state.
    """

    def __init__(self, scenario: Recorded) -> None:
        opening = scenario.measure()
        self._frames = {name: [np.array(opening[name])] for name in scenario.recorded}
        constants = scenario.constants_of_episode() if isinstance(scenario, Animated) else {}
        self._constants = {name: np.array(value) for name, value in constants.items()}
        self._rewards: list[FloatArray] = []

    def add(self, transition: Transition) -> None:
        """Record a step."""
        for name, frames in self._frames.items():
            frames.append(np.array(transition.info[name]))
        self._rewards.append(np.array(transition.reward, dtype=float))

    def recording(self) -> dict[str, Any]:
        """Return the recorded arrays by name."""
        arrays = {name: np.stack(frames) for name, frames in self._frames.items()}
        return arrays | {"reward": np.array(self._rewards)} | self._constants
