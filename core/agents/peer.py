"""Joint learners: users' classes that choose the whole joint action.

A `Peer` observes the same state variables and receives the same rewards as a hierarchy of agents.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from ..decision.exploration import no_way_on
from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Memory, Placement
from ..interface.experience import Experience, Observation
from ..interface.scenario import Transition
from ..learners.learner import CORE, TeamSettings
from ..numerics import AnyArray, FloatArray, IntArray


class PeerSettings(TeamSettings):
    """Settings that all joint learners share.

    `build` returns the `Peer` for a scenario, a seed and, if it uses one, a hierarchy.
    """

    kind_of_agents = f"{CORE}.agents.peer:PeerAgents"
    discount: Annotated[float, Field(ge=0, lt=1)] = 0.97
    """Discount per decision."""


class Peer(ABC):
    """Base class of joint learners. Without overriding more than `act` it learns nothing.

    Parameters
    ----------
    seed
        Seed of everything random in it.
    """

    is_sampled = False
    """Whether its policy is stochastic, so that sampled actions are evaluated, too."""

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self.rng = np.random.Generator(np.random.PCG64(seed))

    def begin_episode(self) -> None:  # noqa: B027 - optional
        """Start an episode of learning."""

    @abstractmethod
    def act(self, seen: Observation, *, explore: bool = True) -> IntArray:
        """Return a joint action ``(n,)``, the greedy one unless it explores."""

    def learn(self, transition: Transition) -> None:  # noqa: B027 - optional
        """Learn from a step."""

    def end_episode(self) -> None:  # noqa: B027 - optional
        """Learn after an episode."""

    def arrays(self) -> dict[str, FloatArray]:
        """Return what it has learned."""
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
        """Start with what a learner of equal settings has learned elsewhere.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        raise ValueError(no_way_on("learner.kind", self))


@dataclass
class PeerInputs:
    """Inputs of a joint decision."""

    seen: Observation
    explore: bool
    joint_action: IntArray | None = None
    """``(n,)`` the joint action, once it has been chosen."""


class PeerAgents(Agents[PeerInputs]):
    """The agents of a team whose joint action a `Peer` chooses.

    Parameters
    ----------
    settings
        Settings of the learner.
    placement
        Scenario, seed and hierarchy.
    """

    def __init__(self, settings: PeerSettings, placement: Placement) -> None:
        hierarchies = (placement.hierarchy,) if settings.uses_hierarchy else ()
        self.peer: Peer = settings.build(placement.scenario, placement.seed, *hierarchies)
        self.rng = self.peer.rng
        self.is_sampled = self.peer.is_sampled

    def begin_episode(self) -> None:
        """Start an episode of learning."""
        self.peer.begin_episode()

    def perceive(self, seen: Observation, *, explore: bool) -> PeerInputs:
        """Return the inputs of a decision."""
        return PeerInputs(seen, explore)

    def decide(self, inputs: PeerInputs, turn: Turn) -> IntArray:
        """Return the actions of the agents of a turn; the first turn chooses those of all."""
        if inputs.joint_action is None:
            joint_action = self.peer.act(inputs.seen, explore=inputs.explore)
            inputs.joint_action = np.asarray(joint_action)
        return inputs.joint_action[turn.agents]

    def learn(self, experience: Experience, inputs: PeerInputs) -> None:
        """Learn from a step."""
        self.peer.learn(experience.transition)
        if experience.last:
            self.peer.end_episode()

    def memory(self) -> Memory:
        """Return what has been learned."""
        return dict(self.peer.arrays())

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned, if the learner can."""
        self.peer.restore(memory)

    def continue_from(self, former: Self) -> None:
        """Start with what was learned elsewhere, if the learner can."""
        self.peer.continue_from(former.peer)
