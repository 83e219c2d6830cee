"""Interface of all kinds of agents: fuzzy agents, policy networks, functions, users' classes.

A team consists of one or several parts. A part, `Agents`, decides and learns for some members of
the team. In a joint decision every part first calls `observe`, which returns its *inputs*. The
members then `act`, stage by stage of the hierarchy, given the messages that they receive. The
inputs are kept with the decision and passed to `learn` after the step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, Self, TypeAlias, TypeVar, runtime_checkable

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import Inbox
from ..numerics import AnyArray, BoolArray, FloatArray, IntArray
from ..plugins.words import show
from .environments import Transitions
from .experience import Experience, Observation
from .measures import Measure
from .scenario import Scenario

I = TypeVar("I")  # noqa: E741 - inputs of a kind of agents
Inputs: TypeAlias = Any
"""Inputs of any kind of agents, which receive their own."""
StateDict = dict[str, AnyArray]
"""Saved state as named arrays."""


def select_prefix(prefix: str, state: Mapping[str, AnyArray]) -> StateDict:
    """Return the arrays with a prefix in their names, and remove the prefix.

    >>> select_prefix("part1.", {"part1.seen": np.zeros(2), "part2.seen": np.ones(1)})
    {'seen': array([0., 0.])}
    """
    return {name.removeprefix(prefix): state[name] for name in state if name.startswith(prefix)}


def add_prefix(prefix: str, state: Mapping[str, AnyArray]) -> StateDict:
    """Return arrays with a prefix before their names, see `select_prefix`."""
    return {f"{prefix}{name}": array for name, array in state.items()}


@dataclass(frozen=True)
class AgentContext:
    """Scenario, hierarchy and random seed for which agents are built."""

    scenario: Scenario
    """Scenario in which they act."""
    hierarchy: Hierarchy
    """Hierarchy of all agents of the team."""
    members: IntArray
    """``(k,)`` agents of the team that belong to this part, in agent order."""
    seed: np.random.SeedSequence
    """Seed of all random numbers of the part."""
    messages_fail: bool = False
    """Whether messages may be lost, late or wrong."""

    @property
    def is_whole(self) -> bool:
        """Whether the part is the whole team."""
        return len(self.members) == len(self.hierarchy)


@dataclass
class Counts:
    """Number of evaluations and updates so far."""

    joint_actions: int = 0
    """Joint actions tried."""
    rule_evaluations: int = 0
    """Joint actions tried times the number of rules evaluated for each."""
    weight_updates: int = 0
    """Consequent weights changed by learning."""

    def add(self, other: Counts) -> None:
        """Add the counts of other agents."""
        for name, count in vars(other).items():
            vars(self)[name] += count


class Agents(ABC, Generic[I]):
    """A part of a team: agents of one kind.

    Subclasses implement `observe`, `act`, `state_dict`, `load_state_dict` and `warm_start`. The
    other members have defaults. Optional abilities are the protocols below; `Team` asks for them.
    """

    acts_in_parallel: bool = False
    """Whether all members of a stage decide in one call. Otherwise a stage is one member."""
    is_stochastic: bool = False
    """Whether the policy is stochastic, so that sampled actions are evaluated, too."""
    rng: np.random.Generator
    """Source of the random numbers of all decisions."""

    def reset(self, episode: int, *, learn: bool) -> None:
        """Start an episode, of training if the agents `learn`, else of evaluation."""

    @abstractmethod
    def observe(self, observation: Observation, *, explore: bool) -> I:
        """Return the inputs of the next decision."""

    @abstractmethod
    def act(self, inputs: I, inbox: Inbox) -> IntArray:
        """Return the actions ``(k,)`` of the agents of a stage, given the messages to them."""

    def learn(self, experience: Experience, inputs: I) -> None:
        """Learn from a step; after the last step of an episode, also from the episode."""

    @abstractmethod
    def state_dict(self) -> StateDict:
        """Return the saved state."""

    @abstractmethod
    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of other agents.
        """

    @abstractmethod
    def warm_start(self, former: Self) -> None:
        """Start with what agents of the same settings learned in another scenario or hierarchy.

        Raises
        ------
        ValueError
            If it cannot be used here; one line.
        """


AnyAgents: TypeAlias = Agents[Any]
"""Agents of any kind."""


@runtime_checkable
class Vectorized(Protocol):
    """Agents act and learn in many environments at once, with states ``(E, n, d)``."""

    def learn_batch(
        self, joint_actions: IntArray, inputs: Inputs, steps: Transitions, last: BoolArray
    ) -> None:
        """Learn from one step of many environments.

        Parameters
        ----------
        joint_actions
            ``(E, n)`` joint actions.
        inputs
            Inputs of the decision.
        steps
            Result of the step.
        last
            ``(E,)`` whether an episode ends with this step.
        """


@runtime_checkable
class SendsPayloads(Protocol):
    """Messages of the agents contain more than their actions."""

    def payloads(self, inputs: Inputs) -> Mapping[int, object]:
        """Return the payloads of the messages sent so far in this decision, by agent."""


@runtime_checkable
class ObservesJointActions(Protocol):
    """Agents learn about each other by their actions, in training and in evaluation."""

    def conclude(self, inputs: Inputs, joint_action: IntArray) -> None:
        """Receive the joint action ``(n,)`` before the step."""


@runtime_checkable
class Rearrangeable(Protocol):
    """Agents know who has left the team."""

    def rearrange(self, hierarchy: Hierarchy, left: IntArray, actions: IntArray) -> None:
        """Decide in a repaired hierarchy, because agents have left or joined the team.

        Parameters
        ----------
        hierarchy
            Repaired hierarchy; agents that have left have no edges.
        left
            ``(k,)`` agents that have left.
        actions
            ``(k,)`` their actions meanwhile, which all agents know.
        """


@runtime_checkable
class ReportsCosts(Protocol):
    """Decisions of the agents have costs, which become columns of results."""

    costs: tuple[Measure, ...]
    """Measures of the costs of decisions."""

    def decision_costs(self, inputs: Inputs, joint_action: IntArray) -> Mapping[str, float]:
        """Return the costs of a decision by the names of `costs`."""


@runtime_checkable
class ReportsResources(Protocol):
    """Computation and memory of the agents are measured."""

    @property
    def counts(self) -> Counts:
        """Number of evaluations so far."""

    @property
    def weight_bytes(self) -> int:
        """Memory of the learned weights [bytes]."""


@runtime_checkable
class Inspectable(Protocol):
    """The values by which the agents decide can be shown."""

    def action_values(self, inputs: Inputs) -> Mapping[int, FloatArray]:
        """Return the values ``(A,)`` of the actions of each member after a decision.

        Policies return the log probabilities of actions.
        """


@runtime_checkable
class RecordsValues(Protocol):
    """Agents keep the values of actions only in a decision that is inspected."""

    def record_values(self, inputs: Inputs) -> None:
        """Keep the values of actions in this decision, for `Inspectable.action_values`."""


@runtime_checkable
class ValuesStates(Protocol):
    """Agents have a value function of their states."""

    def value(self, agent: int, states: FloatArray) -> FloatArray:
        """Return the value function of an agent at states ``(..., d)``.

        Raises
        ------
        ValueError
            If the states have other variables; one line.
        """


def checked_actions(agents: object, actions: object, n_actions: int) -> IntArray:
    """Return actions that agents chose.

    Raises
    ------
    ValueError
        If one is no index of an action; one line.
    """
    chosen = np.asarray(actions)
    if chosen.dtype.kind not in "iu" or chosen.min() < 0 or chosen.max() >= n_actions:
        raise ValueError(
            f"{type(agents).__name__}.act returns {show(actions)}, allowed: whole numbers from 0 "
            f"to {n_actions - 1}"
        )
    return chosen
