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

from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, StateDict
from ..interface.experience import Experience, Observation
from ..interface.scenario import Transition
from ..learners.learner import CORE, TeamSettings
from ..numerics import AnyArray, FloatArray, IntArray
from ..search.exploration import no_way_on


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

    is_stochastic = False
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

    def state_dict(self) -> dict[str, FloatArray]:
        """Return what it has learned."""
        return {}

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        if state:
            raise ValueError(f"learner.kind: {type(self).__name__} has no method load_state_dict")

    def warm_start(self, former: Self) -> None:
        """Start with what a learner of equal settings has learned elsewhere.

        Raises
        ------
        ValueError
            If it cannot; one line.
        """
        raise ValueError(no_way_on("learner.kind", self, "warm_start"))


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
    context
        Scenario, seed and hierarchy.
    """

    def __init__(self, settings: PeerSettings, context: AgentContext) -> None:
        hierarchies = (context.hierarchy,) if settings.uses_hierarchy else ()
        self.peer: Peer = settings.build(context.scenario, context.seed, *hierarchies)
        self.rng = self.peer.rng
        self.is_stochastic = self.peer.is_stochastic

    def begin_episode(self) -> None:
        """Start an episode of learning."""
        self.peer.begin_episode()

    def observe(self, seen: Observation, *, explore: bool) -> PeerInputs:
        """Return the inputs of a decision."""
        return PeerInputs(seen, explore)

    def act(self, inputs: PeerInputs, inbox: Inbox) -> IntArray:
        """Return the actions of the agents of a turn; the first turn chooses those of all."""
        if inputs.joint_action is None:
            joint_action = self.peer.act(inputs.seen, explore=inputs.explore)
            inputs.joint_action = np.asarray(joint_action)
        return inputs.joint_action[inbox.agents]

    def learn(self, experience: Experience, inputs: PeerInputs) -> None:
        """Learn from a step."""
        self.peer.learn(experience.transition)
        if experience.last:
            self.peer.end_episode()

    def state_dict(self) -> StateDict:
        """Return what has been learned."""
        return dict(self.peer.state_dict())

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`, if the learner can."""
        self.peer.load_state_dict(state)

    def warm_start(self, former: Self) -> None:
        """Start with what was learned elsewhere, if the learner can."""
        self.peer.warm_start(former.peer)
