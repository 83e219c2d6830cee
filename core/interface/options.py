"""Options: actions that last, decided by a leader above the agents of a scenario.

A leader decides when its option has ended; meanwhile its message stands (Sutton, Precup and Singh
1999). What the option means to the agents below is up to the scenario: it may change the states
that they observe, or act for them by a given skill. A scenario with leaders inherits from
`LedScenario`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from ..numerics import FloatArray, IntArray
from .scenario import Scenario, Transition
from .spaces import ActionSet, StateSpace

if TYPE_CHECKING:
    from ..learners.learner import TeamSettings


class Options(ABC):
    """Options of the leader in one scenario."""

    state_space: StateSpace
    """The variables of the leader."""
    action_set: ActionSet
    """The options by name."""
    learner: TeamSettings | None
    """Settings of a leader that learns; None for the leader by rule."""
    limit: int
    """Number of decisions of the agents below after which an option ends."""

    @abstractmethod
    def observe(self) -> FloatArray:
        """Return the variables ``(d,)`` of the leader in the present state."""

    @abstractmethod
    def rule(self) -> int:
        """Return the option that the leader by rule decides on."""

    @abstractmethod
    def reward(self, transition: Transition) -> float:
        """Return the leader's reward for a step of the scenario."""

    @abstractmethod
    def begin(self, option: int) -> FloatArray:
        """Begin an option; return the states ``(n, d)`` that the agents below then observe."""

    @abstractmethod
    def has_ended(self) -> bool:
        """Return whether the option has ended; called once before every further decision."""

    @abstractmethod
    def joint_action(self) -> IntArray | None:
        """Return the actions ``(n,)`` of a given skill; None if the agents below decide."""


class LedScenario(Scenario):
    """A scenario whose agents may have a leader."""

    options: Options | None = None
    """Options of the leader; None without a leader."""
