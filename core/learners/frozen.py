"""The learner that never learns: the control of every learning curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from .learner import LearnerSettings

if TYPE_CHECKING:
    from ..rules.rule_base import RuleBase


class FrozenSettings(LearnerSettings):
    """No learning: the consequents stay zero. The control of every learning curve."""

    kind: Literal["frozen"] = "frozen"

    def build(self, rules: RuleBase, rows: IntArray) -> Frozen:
        """Return the learner of a team."""
        return Frozen(rules, rows)


class Frozen:
    """Never learns: the consequent weights stay as they are, zero from the start."""

    def __init__(self, rules: RuleBase, rows: IntArray) -> None:
        self.theta: FloatArray = np.zeros((int(rows.max()) + 1, rules.n_rules), rules.dtype)

    def begin_episode(self) -> None:
        """Nothing to forget."""

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
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

    def continue_from(self, former: Frozen, rows: IntArray) -> None:
        """Begin with the consequent weights of another team."""
        self.theta = former.theta[rows]
