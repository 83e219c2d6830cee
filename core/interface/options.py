"""Options: actions that last, of a leader above the agents of a scenario.

A leader decides when its option has ended; meanwhile its message stands (Sutton, Precup and Singh
1999). The scenario defines what an option means to the agents below: it changes the states that
they observe, or a given skill acts for them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from ..numerics import FloatArray, IntArray
from ..plugins.settings import PartSettings
from .spaces import ActionSet, StateSpace


class LeaderOptions(ABC):
    """Options of the leader in one scenario, see `abilities.Led`."""

    state_space: StateSpace
    """Variables of the leader."""
    action_set: ActionSet
    """Names of the options."""
    learner: PartSettings | None
    """Settings of a leader that learns, `FittedQSettings`; None for a leader by rule."""
    limit: int
    """Number of decisions of the agents below after which an option ends."""

    @abstractmethod
    def observe(self) -> FloatArray:
        """Return the variables ``(d,)`` of the leader in the present state."""

    @abstractmethod
    def rule(self) -> int:
        """Return the option on which a leader by rule decides."""

    @abstractmethod
    def begin(self, option: int) -> FloatArray:
        """Begin an option and return the states ``(n, d)`` that the agents below then observe."""

    @abstractmethod
    def advance(self) -> bool:
        """Return whether the option continues; called before each decision except the first."""

    @abstractmethod
    def joint_action(self) -> IntArray | None:
        """Return the actions ``(n,)`` of a given skill; None if the agents below decide."""
