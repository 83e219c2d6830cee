"""Joint learners: users' classes that choose the whole joint action.

A `Peer` observes the same state variables and receives the same rewards as a hierarchy of agents.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cache
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, StateDict
from ..interface.experience import Experience, Observation
from ..interface.scenario import Transition
from ..learners import check_prediction
from ..learners.learner import CORE, TeamSettings
from ..numerics import AnyArray, FloatArray, IntArray
from ..plugins.words import show
from ..search.exploration import warm_start_refusal


class PeerSettings(TeamSettings):
    """Settings that all joint learners share.

    `build` returns the `Peer` for a scenario, a seed and, if it uses one, a hierarchy.
    """

    kind_of_agents = f"{CORE}.agents.peer:PeerAgents"
    discount: Annotated[float, Field(ge=0, lt=1)] = 0.97
    """Discount per decision."""


class Peer(ABC):
    """Base class of joint learners. A subclass that overrides only `act` does not learn.

    Parameters
    ----------
    seed
        Seed of its random numbers.
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
        """Return the learned arrays by name."""
        return {}

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If the learner does not support it; one line.
        """
        if state:
            raise ValueError(f"learner.kind: {type(self).__name__} has no method load_state_dict")

    def warm_start(self, former: Self) -> None:
        """Start with what a learner with equal settings has learned in another scenario.

        Raises
        ------
        ValueError
            If the learner does not support it; one line.
        """
        raise ValueError(warm_start_refusal("learner.kind", self))


PeerInputs = Callable[[], IntArray]
"""Returns the joint action ``(n,)`` of a decision, which is chosen once."""


class PeerAgents(Agents[PeerInputs]):
    """Agents of a team with joint actions chosen by a `Peer`.

    Parameters
    ----------
    settings
        Settings of the learner.
    context
        Scenario, seed and hierarchy.
    """

    def __init__(self, settings: PeerSettings, context: AgentContext) -> None:
        check_prediction(settings, context.scenario)
        hierarchies = (context.hierarchy,) if settings.uses_hierarchy else ()
        self.peer: Peer = settings.build(context.scenario, context.seed, *hierarchies)
        self.rng = self.peer.rng
        self.is_stochastic = self.peer.is_stochastic
        self._shape = (len(context.scenario.agents),)
        self._n_actions = len(context.scenario.action_set)

    def reset(self, episode: int, *, learn: bool) -> None:
        """Start an episode."""
        if learn:
            self.peer.begin_episode()

    def observe(self, seen: Observation, *, explore: bool) -> PeerInputs:
        """Return the inputs of a decision."""
        return cache(lambda: self._checked(self.peer.act(seen, explore=explore)))

    def _checked(self, joint_action: object) -> IntArray:
        """Return a joint action of the peer, or refuse it."""
        actions = np.asarray(joint_action)
        is_whole = actions.shape == self._shape and actions.dtype.kind in "iu"
        if not is_whole or actions.min() < 0 or actions.max() >= self._n_actions:
            raise ValueError(
                f"{type(self.peer).__name__}.act returns {show(joint_action)}, allowed: a whole "
                f"number from 0 to {self._n_actions - 1} for each of {self._shape[0]} agents"
            )
        return actions

    def act(self, inputs: PeerInputs, inbox: Inbox) -> IntArray:
        """Return the actions of a stage; the first stage chooses the joint action."""
        return inputs()[inbox.agents]

    def learn(self, experience: Experience, inputs: PeerInputs) -> None:
        """Learn from a step."""
        self.peer.learn(experience.transition)
        if experience.last:
            self.peer.end_episode()

    def state_dict(self) -> StateDict:
        """Return the learned arrays by name."""
        return dict(self.peer.state_dict())

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`, if the learner can."""
        self.peer.load_state_dict(state)

    def warm_start(self, former: Self) -> None:
        """Start with what was learned in another scenario, if the learner supports it."""
        self.peer.warm_start(former.peer)
