"""Many worlds at once: the axis of worlds stands first, ``(W, n, d)``.

Any scenario can be stepped so, by a loop over instances. A scenario that steps its worlds in one
call offers worlds of its own, by `Scenario.worlds`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from ..numerics import BoolArray, FloatArray, IntArray
from .scenario import Scenario

S = TypeVar("S", bound=Scenario)


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


class StackedWorlds(Worlds, Generic[S]):
    """Worlds whose states are stacked, and stepped in one call.

    An episode is begun by the scenario itself, world by world: the same seed is the same world.

    Parameters
    ----------
    scenario
        What all of them are; it is modified.
    count
        How many.
    """

    def __init__(self, scenario: S, count: int) -> None:
        self.scenario = scenario
        self.count = count
        self.stack(scenario, count)

    @abstractmethod
    def stack(self, world: S, count: int) -> None:
        """Make room for what `count` worlds are in."""

    @abstractmethod
    def take(self, place: int, world: S) -> None:
        """Put what a world has begun with in its place."""

    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some worlds."""
        states = []
        for k, (place, seed) in enumerate(zip(places, seeds, strict=True)):
            states.append(self.scenario.reset(seed, first_episode + k))
            self.take(place, self.scenario)
        return np.stack(states)


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
    >>> worlds.begin(range(3), np.random.SeedSequence(0).spawn(3), 0).shape
    (3, 2, 2)
    >>> worlds.step(np.zeros((3, 2), dtype=int)).rewards.shape
    (3, 2)
    """

    def __init__(self, instances: Sequence[Scenario]) -> None:
        self.instances = instances
        self.count = len(instances)

    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some worlds."""
        begun = enumerate(zip(places, seeds, strict=True), first_episode)
        return np.stack([self.instances[place].reset(seed, k) for k, (place, seed) in begun])

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
        )
