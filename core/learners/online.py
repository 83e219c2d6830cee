"""What the online learners share: traces, and one update per step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from ..arrays import FloatArray
from ..rules.rule_base import RuleBase


class Online(ABC):
    """Learns from one state to the next, all agents at once.

    A terminal state is followed by itself for ever, which adds one update with the reward
    R / (1 - discount) and no next state.
    """

    candidates = 0
    kept: tuple[str, ...] = ("theta", "trace", "reach")
    """Names of the arrays that are saved."""

    def __init__(self, discount: float, rules: RuleBase, n_agents: int) -> None:
        self.discount, self.rules = discount, rules
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules), rules.dtype)
        self.weights = self.theta
        """The consequent weights that learn; those that decide, theta, may be an average."""
        self.trace: FloatArray = np.zeros_like(self.theta)
        self.reach: FloatArray = np.zeros((n_agents, rules.n_parts))
        self._previous: FloatArray | None = None
        self._reward = 0.0

    def begin_episode(self) -> None:
        """Clear the traces."""
        if self._previous is not None:  # memory that is never written is never taken
            self.trace[:], self.reach[:] = 0.0, 0.0
        self._previous = None

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
        """Update for the step from the previous states to these."""
        changed = 0
        if self._previous is not None:
            changed += self._update(self._previous, self._reward, states)
        self._previous, self._reward = states.copy(), reward
        if terminated:
            changed += self._update(states, reward / (1.0 - self.discount), None)
        return changed

    def end_episode(self) -> int:
        """Nothing is left to learn."""
        return 0

    @abstractmethod
    def _update(self, states: FloatArray, reward: float, entered: FloatArray | None) -> int:
        """Learn from R(s) of `states` and the states entered after them, none if terminal.

        Returns the number of weights changed.
        """

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, traces and the previous states with their reward."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        named: dict[str, FloatArray] = {name: getattr(self, name) for name in self.kept}
        return named | {"previous": previous, "reward": np.array(self._reward)}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        for name in self.kept:
            setattr(self, name, arrays[name].copy())
        if "weights" not in self.kept:
            self.weights = self.theta
        self._previous = arrays["previous"].copy() if arrays["previous"].size else None
        self._reward = float(arrays["reward"])
