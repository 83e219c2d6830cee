"""Those who act for all agents by themselves: learners of users, and of other libraries.

A peer sees the same state variables, gets the same rewards and meets the same worlds as a hierarchy
of agents does, and returns a whole joint action.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from ..decision.exploration import no_way_on
from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Memory, Placement
from ..interface.experience import Experience, Observation
from ..interface.scenario import Transition
from ..numerics import AnyArray, FloatArray, IntArray

if TYPE_CHECKING:
    from ..networks.settings import PeerSettings


class Peer(ABC):
    """A learner that acts for all agents by what it sees; inherit it, and add what it learns.

    Without more it learns nothing. What it has learned it gives as `arrays`, and takes back by
    `restore`.

    Parameters
    ----------
    seed
        Source of everything random in it.
    """

    is_sampled = False
    """Whether its policy is one of probabilities, so that sampled actions are evaluated, too."""

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self.rng = np.random.Generator(np.random.PCG64(seed))

    def begin_episode(self) -> None:  # noqa: B027 - by default nothing is to be done
        """Begin an episode of learning."""

    @abstractmethod
    def act(self, seen: Observation, *, explore: bool = True) -> IntArray:
        """Return a joint action ``(n,)``; without `explore` the best that it knows."""

    def learn(self, transition: Transition) -> None:  # noqa: B027 - by default nothing is learned
        """Take in what a step led to."""

    def end_episode(self) -> None:  # noqa: B027
        """Learn what is learned after an episode."""

    def arrays(self) -> dict[str, FloatArray]:
        """Return what has been learned, if anything."""
        return {}

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Continue from what `arrays` returned.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        if arrays:
            raise ValueError(f"learner.kind: {type(self).__name__} has no method restore")

    def continue_from(self, former: Self) -> None:
        """Begin where it ended in another world.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        raise ValueError(no_way_on("learner.kind", self))


@dataclass
class PeerInputs:
    """What a peer decides by."""

    seen: Observation
    """What it sees."""
    explore: bool
    """Whether it explores."""
    joint_action: IntArray | None = None
    """``(n,)`` what it has decided for all, asked once a decision."""


class PeerAgents(Agents[PeerInputs]):
    """A peer as the agents of a team.

    Parameters
    ----------
    settings
        Of the peer, which is built for a scenario, a seed and, if it uses one, a hierarchy.
    placement
        Where it acts.
    """

    def __init__(self, settings: PeerSettings, placement: Placement) -> None:
        hierarchies = (placement.hierarchy,) if settings.uses_hierarchy else ()
        self.peer: Peer = settings.build(placement.scenario, placement.seed, *hierarchies)
        self.rng = self.peer.rng
        self.is_sampled = self.peer.is_sampled

    def begin_episode(self) -> None:
        """Begin an episode of learning."""
        self.peer.begin_episode()

    def perceive(self, seen: Observation, *, explore: bool) -> PeerInputs:
        """Return what it sees."""
        return PeerInputs(seen, explore)

    def decide(self, inputs: PeerInputs, turn: Turn) -> IntArray:
        """Return what it decides for some agents."""
        if inputs.joint_action is None:
            inputs.joint_action = self.decide_all(inputs)
        return inputs.joint_action[turn.agents]

    def decide_all(self, inputs: PeerInputs) -> IntArray:
        """Return what it decides for all."""
        joint: IntArray = self.peer.act(inputs.seen, explore=inputs.explore)
        return joint

    def learn(self, experience: Experience, inputs: PeerInputs) -> None:
        """Let it learn."""
        self.peer.learn(experience.transition)
        if experience.last:
            self.peer.end_episode()

    def memory(self) -> Memory:
        """Return what it has learned."""
        return dict(self.peer.arrays())

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned, if the peer can."""
        self.peer.restore(memory)

    def continue_from(self, former: Self) -> None:
        """Go on where it ended in another world, if the peer can."""
        self.peer.continue_from(former.peer)
