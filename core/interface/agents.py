"""What every kind of agents is to a team: fuzzy agents, networks, whatever users write.

A team walks its hierarchy; its parts decide when it is their turn. `Agents` are one part: the
members for whom they decide, of one kind. A decision goes round like this: all parts `perceive`;
turn by turn members `decide` and are told of in later turns; all parts `conclude`. What a part
perceived and made of it, its *inputs*, is kept with the decision and handed back to it when it
learns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Generic, Self, TypeVar

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.turns import Turn
from ..numerics import AnyArray, BoolArray, IntArray
from .environments import Transitions
from .experience import Experience, Observation
from .measures import Measure
from .scenario import Scenario

I = TypeVar("I")  # noqa: E741 - the inputs of a kind of agents
Memory = dict[str, AnyArray]
"""All that agents remember, as named arrays."""


def under(head: str, memory: Mapping[str, AnyArray]) -> Memory:
    """Return the arrays whose names begin with a head, without it.

    >>> under("part1.", {"part1.seen": np.zeros(2), "part2.seen": np.ones(1)})
    {'seen': array([0., 0.])}
    """
    return {key.removeprefix(head): memory[key] for key in memory if key.startswith(head)}


@dataclass(frozen=True)
class Placement:
    """Where agents act: what their settings are built for."""

    scenario: Scenario
    """The world as they see it."""
    hierarchy: Hierarchy
    """Who decides before whom, of all agents of the team."""
    members: IntArray
    """``(k,)`` the agents for whom they decide, in agent order: all of a team of one kind."""
    seed: np.random.SeedSequence
    """Source of everything random in them."""
    messages_fail: bool = False
    """Whether messages may not arrive as they were sent."""

    @property
    def is_whole(self) -> bool:
        """Whether all agents of the team are theirs."""
        return len(self.members) == len(self.hierarchy)


@dataclass
class Counts:
    """What agents have evaluated so far."""

    joint_actions: int = 0
    """Joint actions tried."""
    rule_evaluations: int = 0
    """Joint actions tried times the rules of the rule base that valued each."""
    weight_updates: int = 0
    """Consequent weights changed by learning."""

    def add(self, other: Counts) -> None:
        """Add what others have evaluated."""
        self.joint_actions += other.joint_actions
        self.rule_evaluations += other.rule_evaluations
        self.weight_updates += other.weight_updates


class Agents(ABC, Generic[I]):
    """A part of a team: agents of one kind."""

    at_once: bool = False
    """Whether members who have been told all that they will be decide in one call; if not, one
    after the other."""
    is_vectorized: ClassVar[bool] = False
    """Whether they can act and learn in many environments at once, ``(E, n, d)``."""
    is_sampled: bool = False
    """Whether their policy is one of probabilities, so that sampled actions are evaluated, too."""
    rng: np.random.Generator
    """Source of all that is random in what they do."""
    has_contents: ClassVar[bool] = False
    """Whether they tell and are told more than actions, and neighbours what was said before."""
    costs: tuple[Measure, ...] = ()
    """What is measured of an episode of what their decisions cost, see `spent`."""

    @property
    def counts(self) -> Counts:
        """What they have evaluated so far, if they count it."""
        return Counts()

    @property
    def weight_bytes(self) -> int:
        """How much memory the weights take that they have learned."""
        return sum(array.nbytes for array in self.memory().values())

    def check(self, seen: Observation) -> None:
        """Refuse a world without what they decide by.

        Raises
        ------
        ValueError
            One line.
        """

    def begin_world(self, episode: int) -> None:
        """Begin an episode, of learning or not."""

    def rearrange(self, hierarchy: Hierarchy, left: IntArray, actions: IntArray) -> None:
        """Decide from now on in another hierarchy of the same agents: some have left, or come back.

        Parameters
        ----------
        hierarchy
            Who decides before whom of those who are there; the others are in no relation.
        left
            ``(k,)`` who has left.
        actions
            ``(k,)`` what these do meanwhile, which all know.
        """

    def begin_episode(self) -> None:
        """Begin an episode of learning."""

    @abstractmethod
    def perceive(self, seen: Observation, *, explore: bool) -> I:
        """Return what a decision is made by: the inputs of all members."""

    @abstractmethod
    def decide(self, inputs: I, turn: Turn) -> IntArray:
        """Return the actions ``(k,)`` of members whose turn it is; what they are told is noted."""

    def contents(self, inputs: I) -> Mapping[int, object]:
        """Return by agent what has been said beside its action, in this decision so far."""
        return {}

    def spent(self, inputs: I) -> Mapping[str, float]:
        """Return what a decision has cost, by the names of `costs`."""
        return {}

    def conclude(self, inputs: I, joint_action: IntArray) -> None:
        """Take in what all have decided, before it is done."""

    def learn(self, experience: Experience, inputs: I) -> None:
        """Learn from what a decision led to; of the `last` one of an episode, all of it."""

    def learn_batch(self, joint: IntArray, inputs: I, steps: Transitions, last: BoolArray) -> None:
        """Learn from one step of many environments; only vectorized agents can.

        Parameters
        ----------
        joint
            ``(E, n)`` joint actions.
        inputs
            Inputs of the decision.
        steps
            Result of the step.
        last
            ``(E,)`` whether an episode ends with this step.
        """
        raise NotImplementedError(f"{type(self).__name__} learns in one environment")

    @abstractmethod
    def memory(self) -> Memory:
        """Return all that they remember."""

    @abstractmethod
    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned.

        Raises
        ------
        ValueError
            If it is that of other agents.
        """

    @abstractmethod
    def continue_from(self, former: Self) -> None:
        """Begin where agents of the same settings ended in another world, or hierarchy.

        Raises
        ------
        ValueError
            If what those have learned means nothing here; one line.
        """

    def check_world(self, scenario: Scenario) -> None:
        """Refuse another world for the very same agents.

        Raises
        ------
        ValueError
            If what they have learned means nothing there; one line.
        """
