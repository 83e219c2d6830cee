"""Interfaces of dynamics models and of models that adapt to experience."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Generic, Self, TypeVar

from ..interface.prediction import Prediction
from ..interface.scenario import Transition
from ..numerics import FloatArray, IntArray

P = TypeVar("P", bound=Prediction)


class DynamicsModel(ABC):
    """Predicts from states alone, instead of the scenario."""

    @abstractmethod
    def predict(self, states: FloatArray) -> Prediction:
        """Predict from states ``(n, d)``."""


class Adaptive(ABC, Generic[P]):
    """A model that is updated by the outcomes of joint actions."""

    @abstractmethod
    def adapt(self, prediction: P, joint_action: IntArray, transition: Transition) -> None:
        """Update the model by a prediction and the outcome of a joint action ``(n,)``."""

    def end_episode(self) -> None:
        """Make the updates that follow an episode."""

    @abstractmethod
    def state_dict(self) -> dict[str, FloatArray]:
        """Return the saved state."""

    @abstractmethod
    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""

    @abstractmethod
    def warm_start(self, former: Self) -> None:
        """Start from another model's state if both describe the same bodies."""
