"""Scripted Bayesian agents, which weigh their signal and all messages.

They do not learn. They know everything except the state: the accuracy of signals, the hierarchy,
and that all agents are Bayesian. A spec names them as a learner::

    learner.kind = "bayesian"

An agent must receive every message that its senders received, as with ``communication =
"ancestors"``. It then knows the log odds by which each sender decided, and how much the sender's
decision adds to its own log odds. In other hierarchies it would have to guess them;
`theory.enumerated` has the exact numbers for a few agents.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

import nested_agents as na

from .scenario import BoolArray, FloatArray, IntArray, Signals
from .theory import Indifferent, evidence, naming, unweighed


class Bayesian(na.TeamSettings):
    """Agents name the more probable state, given their signal and all messages."""

    uses_hierarchy = True
    kind_of_agents = f"{__name__}:BayesianAgents"
    indifferent: Indifferent = "signal"
    """Decision of an agent for which both states are equally probable: its signal, or a coin."""


@dataclass
class Beliefs:
    """Inputs of a decision; leading axes ``...`` are those of environments."""

    signals: BoolArray
    """Whether the signal of an agent is b ``(..., n)``."""
    tells: FloatArray
    """Log odds that follow from an agent naming a, or b ``(..., n, 2)``; set stage by stage."""


class BayesianAgents(na.Agents[Beliefs]):
    """Scripted Bayesian agents, in one environment or many.

    Parameters
    ----------
    settings
        Decision rule of indifferent agents.
    context
        Scenario, hierarchy, and random seed of the agents.

    Raises
    ------
    ValueError
        If the scenario is not `signals`, messages can fail, or an agent receives a message that it
        cannot weigh.
    """

    acts_in_parallel = True

    def __init__(self, settings: Bayesian, context: na.AgentContext) -> None:
        self.rng = np.random.Generator(np.random.PCG64(context.seed))
        self.indifferent = settings.indifferent
        scenario = context.scenario
        if not isinstance(scenario, Signals):
            raise ValueError(f"learner.kind = {settings.kind!r}: needs scenario.kind = 'signals'")
        self.accuracy = scenario.settings.accuracy
        if context.messages_fail:
            raise ValueError(
                f"learner.kind = {settings.kind!r}: assumes that all messages arrive; remove "
                "topology.failures"
            )
        names = context.hierarchy.agents
        problem = unweighed(context.hierarchy)
        if problem is not None:
            raise ValueError(
                f"topology: {names[problem[0]]} hears {names[problem[1]]}, but not all agents that "
                "this one hears; set topology.communication = 'ancestors' or 'none'"
            )

    def observe(self, seen: na.Observation, *, explore: bool) -> Beliefs:
        """Return the signals; no message has been received yet."""
        signals = seen.states[..., 0] > 0.5
        return Beliefs(signals, np.zeros((*signals.shape, 2)))

    def act(self, inputs: Beliefs, inbox: na.Inbox) -> IntArray:
        """Return the named states of the agents of a stage; store the evidence that they give."""
        lead = inputs.signals.shape[:-1]
        public: FloatArray = np.zeros((*lead, len(inbox.agents)))
        if len(inbox.senders):
            told = inputs.tells[..., inbox.senders, :]
            adds = np.where(inbox.actions == 1, told[..., 1], told[..., 0])
            first = np.flatnonzero(np.diff(inbox.receivers, prepend=-1))
            places = np.searchsorted(inbox.agents, inbox.receivers[first])
            public[..., places] = np.add.reduceat(adds, first, axis=-1)
        inputs.tells[..., inbox.agents, :] = evidence(public, self.accuracy, self.indifferent)
        by_signal = naming(public, self.accuracy, self.indifferent)
        own = inputs.signals[..., inbox.agents]
        chance = np.where(own, by_signal[..., 1], by_signal[..., 0])
        if self.indifferent == "coin":
            return (self.rng.random(chance.shape) < chance).astype(np.int64)
        return (chance > 0.5).astype(np.int64)

    def learn_batch(
        self, joint_actions: IntArray, inputs: Beliefs, steps: na.Transitions, last: BoolArray
    ) -> None:
        """Do nothing, because nothing is learned."""

    def state_dict(self) -> Mapping[str, NDArray[Any]]:
        """Return no arrays, because nothing is learned."""
        return {}

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Do nothing, because nothing is learned."""

    def warm_start(self, former: Self) -> None:
        """Do nothing, because nothing is learned."""
