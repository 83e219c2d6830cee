"""Interface of models that adapt to experience."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Generic, Self, TypeVar

import numpy as np

from ..interface.prediction import Prediction
from ..interface.scenario import Transition
from ..numerics import FloatArray, IntArray

P = TypeVar("P", bound=Prediction)


class Adaptive(ABC, Generic[P]):
    """A model that is updated by the outcomes of joint actions."""

    memory: dict[str, FloatArray]
    """Arrays that change, by name; memory and time do not grow."""
    bodies: Sequence[FloatArray]
    """Arrays that describe the bodies of the model."""

    @abstractmethod
    def adapt(self, prediction: P, joint_action: IntArray, transition: Transition) -> None:
        """Update the model by a prediction and the outcome of a joint action ``(n,)``."""

    def end_episode(self) -> None:
        """Make the updates that follow an episode."""

    def state_dict(self) -> dict[str, FloatArray]:
        """Return the saved state."""
        return self.memory

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.memory = {name: np.array(state[name]) for name in self.memory}

    def warm_start(self, former: Self) -> None:
        """Start from another model's state if both describe the same bodies."""
        ours, theirs = self.bodies, former.bodies
        if len(ours) == len(theirs) and all(map(np.array_equal, ours, theirs)):
            self.load_state_dict(former.memory)
