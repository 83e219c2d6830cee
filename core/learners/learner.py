"""What every learner is to a team, and the one that never learns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ..arrays import FloatArray
from ..rules import RuleBase


class Learner(Protocol):
    """Turns experience into consequent weights."""

    theta: FloatArray
    """``(n_agents, n_rules)`` consequent weights, one row per agent."""

    def begin_episode(self) -> None:
        """Forget what reached into the past: an episode begins."""
        ...

    def observe(self, states: FloatArray, reward: float, terminated: bool) -> int:
        """Take in the states ``(n, d)`` entered and their reward.

        Returns the number of consequent weights changed.
        """
        ...

    def end_episode(self) -> int:
        """Learn what is learned after an episode. Returns the number of weights changed."""
        ...

    def arrays(self) -> dict[str, FloatArray]:
        """Return everything that `restore` needs."""
        ...

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        ...


class Frozen:
    """Never learns: the consequent weights stay as they are, zero from the start."""

    def __init__(self, rules: RuleBase, n_agents: int) -> None:
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules))

    def begin_episode(self) -> None:
        """Nothing to forget."""

    def observe(self, states: FloatArray, reward: float, terminated: bool) -> int:
        """Change nothing."""
        return 0

    def end_episode(self) -> int:
        """Change nothing."""
        return 0

    def arrays(self) -> dict[str, FloatArray]:
        """Return the consequent weights."""
        return {"theta": self.theta}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Take over the consequent weights."""
        self.theta = arrays["theta"].copy()
