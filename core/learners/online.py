"""What the online learners share: traces and one update per step; and one that never learns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..rules.rule_base import RuleBase
from .learner import LearnerSettings


class Online(ABC):
    """Learns from one state to the next, agent by agent; those of one row change it in turn.

    A terminal state is followed by itself for ever, which adds one update with the reward
    R / (1 - discount) and no next state.
    """

    kept: tuple[str, ...] = ("theta", "trace", "reach")
    """Names of the arrays that are saved: those of rows, and of agents the `traces`."""
    traces = ("trace", "reach")

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        self.settings, self.discount = settings, settings.discount
        self.rules, self.rows = rules, rows
        n_rows = int(rows.max()) + 1
        self.theta: FloatArray = np.zeros((n_rows, rules.n_rules), rules.dtype)
        self.weights = self.theta
        """The consequent weights that learn; those that decide, theta, may be an average."""
        self.trace: FloatArray = np.zeros((len(rows), rules.n_rules), rules.dtype)
        self.reach: FloatArray = np.zeros((len(rows), rules.n_parts))
        self._previous: FloatArray | None = None
        self._rewards: FloatArray = np.zeros(len(rows))

    def of_agents(self, weights: FloatArray) -> FloatArray:
        """Return the row of every agent ``(n, n_rules)``, no copy if each has its own."""
        return weights if len(weights) == len(self.rows) else weights[self.rows]

    def errors(
        self,
        weights: FloatArray,
        states: FloatArray,
        rewards: FloatArray,
        entered: FloatArray | None,
    ) -> FloatArray:
        """Return the TD errors ``(n,)`` of `states` by rows of weights (Eq. 7)."""
        met = states[:, None]
        if entered is not None:
            met = np.empty((len(states), 2, states.shape[1]))
            met[:, 0], met[:, 1] = states, entered
        values = self.rules.each(self.of_agents(weights), met)
        ahead = 0.0 if entered is None else self.discount * values[:, 1]
        return rewards + ahead - values[:, 0]

    def begin_episode(self) -> None:
        """Clear the traces."""
        if self._previous is not None:  # memory that is never written is never taken
            self.trace[:], self.reach[:] = 0.0, 0.0
        self._previous = None

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these."""
        changed = 0
        if self._previous is not None:
            changed += self._update(self._previous, self._rewards, states)
        self._previous = states.copy()
        self._rewards = np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)).copy()
        if terminated:
            changed += self._update(states, self._rewards / (1.0 - self.discount), None)
        return changed

    def end_episode(self) -> int:
        """Nothing is left to learn."""
        return 0

    @abstractmethod
    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        """Learn from R(s) of `states` and the states entered after them, none if terminal.

        Returns the number of weights changed.
        """

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, traces and the previous states with their rewards."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        named: dict[str, FloatArray] = {name: getattr(self, name) for name in self.kept}
        return named | {"previous": previous, "rewards": self._rewards}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        for name in self.kept:
            setattr(self, name, arrays[name].copy())
        if "weights" not in self.kept:
            self.weights = self.theta
        self._previous = arrays["previous"].copy() if arrays["previous"].size else None
        self._rewards = arrays["rewards"].copy()

    def continue_from(self, former: Online, rows: IntArray) -> None:
        """Begin with all weights of another team; traces are of an episode, and begin anew."""
        for name in (name for name in self.kept if name not in self.traces):
            array = getattr(former, name)
            setattr(self, name, array[rows] if array.ndim else array.copy())
        if "weights" not in self.kept:
            self.weights = self.theta


class FrozenSettings(LearnerSettings):
    """No learning: the consequents stay zero. The control of every learning curve."""

    kind: Literal["frozen"] = "frozen"
    factory: ClassVar[str] = f"{__name__}:Frozen"


class Frozen(Online):
    """Never learns: the consequent weights stay as they are, zero from the start."""

    kept = ("theta",)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return 0

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights, which is all there is."""
        return {"theta": self.theta}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore({"previous": self.theta[:0], "rewards": self._rewards, **arrays})
