"""Worlds of scenarios: stacked and stepped in one call, or looped over."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Generic, TypeVar

import numpy as np

from ..numerics import FloatArray, IntArray
from .scenario import Scenario
from .worlds import Transitions, Worlds

S = TypeVar("S", bound=Scenario)


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
