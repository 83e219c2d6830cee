"""Many environments of one scenario, stepped together.

In every array the axis of environments stands first, ``(E, n, d)``. `stacked` has two
implementations: `LoopedEnvironments` for any scenario, and `StackedEnvironments` for scenarios that
step all environments in one call, see `Scenario.environments`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics import BoolArray, FloatArray, IntArray


class Transitions(NamedTuple):
    """Result of one step of ``E`` environments."""

    states: FloatArray
    """``(E, n, d)`` states of the agents after the step."""
    rewards: FloatArray
    """``(E, n)`` reward of every agent."""
    terminated: BoolArray
    """``(E,)`` whether the task is solved, or lost, for good."""
    truncated: BoolArray
    """``(E,)`` whether the episode ends for lack of time."""


class Environments(ABC):
    """``E`` environments of one scenario, stepped together."""

    count: int
    """Number of environments, E."""

    @abstractmethod
    def begin(
        self, indices: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some environments and return their states ``(k, n, d)``.

        Parameters
        ----------
        indices
            ``(k,)`` environments that start an episode.
        seeds
            ``(k,)`` seeds of everything random in them.
        first_episode
            Number of the first of these episodes; the others follow.
        """

    @abstractmethod
    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions ``(E, n)`` for one decision period."""

    def reset(self, seeds: Sequence[np.random.SeedSequence], first_episode: int = 0) -> FloatArray:
        """Start an episode in every environment and return states ``(E, n, d)``."""
        return self.begin(range(self.count), seeds, first_episode)
