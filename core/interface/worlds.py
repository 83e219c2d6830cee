"""Many worlds at once: the axis of worlds stands first, ``(W, n, d)``.

Any scenario can be stepped so, by a loop over instances. A scenario that steps its worlds in one
call offers worlds of its own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..numerics import BoolArray, FloatArray, IntArray
from .scenario import Scenario, Transition


@dataclass(frozen=True)
class Transitions:
    """What one step of ``W`` worlds returns."""

    states: FloatArray
    """``(W, n, d)`` states of the agents after the step."""
    rewards: FloatArray
    """``(W, n)`` what every agent was paid."""
    terminated: BoolArray
    """``(W,)`` where the task is solved (or lost) for good."""
    truncated: BoolArray
    """``(W,)`` where the episode ends for lack of time."""
    each: Sequence[Transition]
    """World by world, what is measured beside."""


class Worlds(ABC):
    """``W`` worlds of one scenario, stepped together."""

    scenario: Scenario
    """What all of them are: agents, state variables, actions."""
    count: int
    """W."""

    @abstractmethod
    def reset(self, seeds: Sequence[np.random.SeedSequence], episode: int = 0) -> FloatArray:
        """Start an episode in every world, by a seed each; return states ``(W, n, d)``."""

    @abstractmethod
    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions ``(W, n)`` for one decision period."""


class LoopedWorlds(Worlds):
    """Worlds that are stepped one after the other.

    Parameters
    ----------
    instances
        Scenarios of the same settings, one for each world.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> worlds = LoopedWorlds([LineUpSettings(carts=2).build() for _ in range(3)])
    >>> worlds.reset([np.random.SeedSequence(seed) for seed in range(3)]).shape
    (3, 2, 2)
    >>> worlds.step(np.zeros((3, 2), dtype=int)).rewards.shape
    (3, 2)
    """

    def __init__(self, instances: Sequence[Scenario]) -> None:
        self.instances = instances
        self.scenario = instances[0]
        self.count = len(instances)

    def reset(self, seeds: Sequence[np.random.SeedSequence], episode: int = 0) -> FloatArray:
        """Start an episode in every world."""
        worlds = zip(self.instances, seeds, strict=True)
        return np.stack([world.reset(seed, episode) for world, seed in worlds])

    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions, world by world."""
        worlds = zip(self.instances, joint_actions, strict=True)
        each = [world.step(joint) for world, joint in worlds]
        n = joint_actions.shape[1]
        return Transitions(
            states=np.stack([transition.states for transition in each]),
            rewards=np.stack([np.broadcast_to(transition.reward, n) for transition in each]),
            terminated=np.array([transition.terminated for transition in each]),
            truncated=np.array([transition.truncated for transition in each]),
            each=each,
        )
