"""Implementations of `Environments`: stacked and stepped in one call, or looped over."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

import numpy as np

from ..numerics import FloatArray, IntArray
from .abilities import Batched
from .environments import Environments, Transitions
from .scenario import Scenario, checked_transition

S = TypeVar("S", bound=Scenario)


class StackedEnvironments(Environments, Generic[S]):
    """Environments with stacked states, which are stepped in one call.

    One scenario starts the episodes of all environments, one after the other, so that equal seeds
    give equal episodes however many environments there are.

    Parameters
    ----------
    scenario
        Scenario of all environments; it is modified.
    count
        Number of environments.
    """

    def __init__(self, scenario: S, count: int) -> None:
        self.scenario = scenario
        self.count = count
        self.allocate(scenario, count)

    @abstractmethod
    def allocate(self, scenario: S, count: int) -> None:
        """Allocate the state of `count` environments."""

    @abstractmethod
    def store(self, index: int, scenario: S) -> None:
        """Copy the initial state of a scenario into the environment with this index."""

    def begin(
        self, indices: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some environments."""
        states = []
        for k, (index, seed) in enumerate(zip(indices, seeds, strict=True)):
            states.append(self.scenario.reset(seed, first_episode + k))
            self.store(index, self.scenario)
        return np.stack(states)


def make_environments(make: Callable[[], Scenario], count: int) -> Environments:
    """Return `count` environments, which step in one call if their scenario supports this.

    Parameters
    ----------
    make
        Returns a scenario; the scenarios have equal settings.
    count
        Number of environments.
    """
    first = make()
    environments = first.environments(count) if isinstance(first, Batched) else None
    if environments is None:
        return LoopedEnvironments([first, *(make() for _ in range(count - 1))])
    return environments


class LoopedEnvironments(Environments):
    """Environments that are stepped one after the other.

    Parameters
    ----------
    instances
        Scenarios of equal settings, one for each environment.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> environments = LoopedEnvironments([LineUpSettings(carts=2).build() for _ in range(3)])
    >>> environments.begin(range(3), np.random.SeedSequence(0).spawn(3), 0).shape
    (3, 2, 2)
    >>> environments.step(np.zeros((3, 2), dtype=int)).rewards.shape
    (3, 2)
    """

    def __init__(self, instances: Sequence[Scenario]) -> None:
        self.instances = instances
        self.count = len(instances)

    def begin(
        self, indices: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some environments."""
        episodes = enumerate(zip(indices, seeds, strict=True), first_episode)
        started = [(self.instances[index], seed, k) for k, (index, seed) in episodes]
        return np.stack(
            [s.state_space.checked(s.reset(seed, k), s.agents) for s, seed, k in started]
        )

    def step(self, joint_actions: IntArray) -> Transitions:
        """Carry out joint actions, one environment after the other."""
        pairs = zip(self.instances, joint_actions, strict=True)
        transitions = [
            checked_transition(s.step(joint_action.copy()), s.state_space, s.agents)
            for s, joint_action in pairs
        ]
        n = joint_actions.shape[1]
        return Transitions(
            states=np.stack([transition.states for transition in transitions]),
            rewards=np.stack([np.broadcast_to(t.reward, n) for t in transitions]),
            terminated=np.array([transition.terminated for transition in transitions]),
            truncated=np.array([transition.truncated for transition in transitions]),
        )
