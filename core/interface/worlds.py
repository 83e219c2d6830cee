"""Many worlds at once: the axis of worlds stands first, ``(W, n, d)``.

Any scenario can be stepped so, by a loop over instances, see `stacked`. A scenario that steps its
worlds in one call offers worlds of its own, by `Scenario.worlds`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics import BoolArray, FloatArray, IntArray


class Transitions(NamedTuple):
    """What one step of ``W`` worlds returns."""

    states: FloatArray
    """``(W, n, d)`` states of the agents after the step."""
    rewards: FloatArray
    """``(W, n)`` what every agent was paid."""
    terminated: BoolArray
    """``(W,)`` where the task is solved (or lost) for good."""
    truncated: BoolArray
    """``(W,)`` where the episode ends for lack of time."""


class Worlds(ABC):
    """``W`` worlds of one scenario, stepped together."""

    count: int
    """W."""

    @abstractmethod
    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some worlds, by a seed each; return their states ``(k, n, d)``.

        Parameters
        ----------
        places
            ``(k,)`` which worlds.
        seeds
            ``(k,)`` of everything random in each.
        first_episode
            Number of the first of these episodes; the others follow.
        """

    @abstractmethod
    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions ``(W, n)`` for one decision period."""

    def reset(self, seeds: Sequence[np.random.SeedSequence], first_episode: int = 0) -> FloatArray:
        """Start an episode in every world, by a seed each; return states ``(W, n, d)``."""
        return self.begin(range(self.count), seeds, first_episode)
