"""Bayesian agents: what they are told they weigh as those who tell it were led to it.

They learn nothing, and know what there is to know of the world but the state: how accurate signals
are, who is told by whom, and that all are Bayesian. A spec names them as their own learner::

    learner.kind = "nested_agents.scenarios.signals.bayesian:Bayesian"

An agent must have been told all that those were told who tell it something, as under
``told = "ancestors"``: then it knows the log odds by which each of them decided, and what their
naming a state adds to its own. In other hierarchies it would have to guess that;
`nested_agents.scenarios.signals.theory.enumerated` has the numbers of a few agents.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from ...core.hierarchy.turns import Turn
from ...core.interface.agents import Agents, Memory, Placement
from ...core.interface.experience import Observation
from ...core.learners.learner import TeamSettings
from ...core.numerics import AnyArray, BoolArray, FloatArray, IntArray
from .scenario import Signals
from .theory import Indifferent, evidence, naming, unweighed


class Bayesian(TeamSettings):
    """Agents that name the more probable state by their signal and all that they are told."""

    uses_hierarchy = True
    kind_of_agents = f"{__name__}:BayesianAgents"
    indifferent: Indifferent = "signal"
    """What an agent names for whom both states are equally probable: its signal, or by a coin."""


@dataclass
class Beliefs:
    """What the agents of worlds ``...`` decide by."""

    signals: BoolArray
    """``(..., n)`` whether an agent's signal is b."""
    tells: FloatArray
    """``(..., n, 2)`` log odds that an agent's naming a, or b, adds; filled in turn by turn."""


class BayesianAgents(Agents[Beliefs]):
    """The agents, in one world or many.

    Parameters
    ----------
    settings
        What they do if they are indifferent.
    placement
        Where they act.

    Raises
    ------
    ValueError
        If that is no world of signals, messages fail, or an agent is told what it cannot weigh.
    """

    at_once = True
    is_vectorized: ClassVar[bool] = True

    def __init__(self, settings: Bayesian, placement: Placement) -> None:
        self.rng = np.random.Generator(np.random.PCG64(placement.seed))
        self.indifferent = settings.indifferent
        scenario = placement.scenario
        if not isinstance(scenario, Signals):
            raise ValueError(
                f"learner.kind = {settings.kind!r}: acts in scenario.kind = 'signals' only, whose "
                "signals it weighs"
            )
        self.accuracy = scenario.settings.accuracy
        if placement.messages_fail:
            raise ValueError(
                f"learner.kind = {settings.kind!r}: weighs messages as if all arrive; leave "
                "topology.failures out"
            )
        names = placement.hierarchy.agents
        problem = unweighed(placement.hierarchy)
        if problem is not None:
            raise ValueError(
                f"topology: {names[problem[0]]} is told what {names[problem[1]]} names, and not "
                "all that this one was told; set topology.told = 'ancestors' or 'none'"
            )

    def perceive(self, seen: Observation, *, explore: bool) -> Beliefs:
        """Return their signals; nothing is told yet."""
        signals = seen.present[..., 0] > 0.5
        return Beliefs(signals, np.zeros((*signals.shape, 2)))

    def decide(self, inputs: Beliefs, turn: Turn) -> IntArray:
        """Return what agents name, whose turn it is, and note what that tells."""
        worlds = inputs.signals.shape[:-1]
        public: FloatArray = np.zeros((*worlds, len(turn.agents)))
        if len(turn.senders):
            told = inputs.tells[..., turn.senders, :]
            adds = np.where(turn.actions == 1, told[..., 1], told[..., 0])
            first = np.flatnonzero(np.diff(turn.receivers, prepend=-1))
            places = np.searchsorted(turn.agents, turn.receivers[first])
            public[..., places] = np.add.reduceat(adds, first, axis=-1)
        inputs.tells[..., turn.agents, :] = evidence(public, self.accuracy, self.indifferent)
        by_signal = naming(public, self.accuracy, self.indifferent)
        own = inputs.signals[..., turn.agents]
        chance = np.where(own, by_signal[..., 1], by_signal[..., 0])
        if self.indifferent == "coin":
            return (self.rng.random(chance.shape) < chance).astype(np.int64)
        return (chance > 0.5).astype(np.int64)

    def memory(self) -> Memory:
        """Return nothing: they learn nothing."""
        return {}

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from nothing."""

    def continue_from(self, former: Self) -> None:
        """Begin in another world as in any."""
