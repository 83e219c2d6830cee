"""What every learner is to a team, and the one that never learns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ..arrays import FloatArray
from ..rules.rule_base import RuleBase


class Learner(Protocol):
    """Turns experience into consequent weights."""

    theta: FloatArray
    """``(n_agents, n_rules)`` consequent weights, one row per agent."""

    candidates: int
    """How many predicted next states per agent `observe` is to be given; 0: none."""

    def begin_episode(self) -> None:
        """Forget what reached into the past: an episode begins."""
        ...

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
        """Take in the states entered; return the number of consequent weights changed.

        Parameters
        ----------
        states
            ``(n, d)`` states that the agents entered.
        reward
            Received on entering them.
        terminated
            Whether they are terminal.
        candidates
            ``(n, candidates, d)`` predicted next states of each agent under random joint actions.
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

    candidates = 0

    def __init__(self, rules: RuleBase, n_agents: int) -> None:
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules), rules.dtype)

    def begin_episode(self) -> None:
        """Nothing to forget."""

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
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
