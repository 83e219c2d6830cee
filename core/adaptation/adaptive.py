"""What predicts, and what revises it: the contracts of dynamics models and of what adapts them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Generic, Self, TypeVar

from ..interface.prediction import Prediction
from ..interface.scenario import Transition
from ..numerics import FloatArray, IntArray

P = TypeVar("P", bound=Prediction)


class DynamicsModel(ABC):
    """Predicts in place of the scenario, from states alone."""

    @abstractmethod
    def predict(self, states: FloatArray) -> Prediction:
        """Predict from states ``(n, d)``."""


class Adaptive(ABC, Generic[P]):
    """Revises what predictions rest on, by what joint actions did."""

    @abstractmethod
    def adapt(self, prediction: P, joint_action: IntArray, transition: Transition) -> None:
        """Hold a prediction against what a joint action ``(n,)`` led to."""

    def end_episode(self) -> None:
        """Revise what is revised after an episode."""

    @abstractmethod
    def arrays(self) -> dict[str, FloatArray]:
        """Return everything that `restore` needs."""

    @abstractmethod
    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""

    @abstractmethod
    def continue_from(self, former: Self) -> None:
        """Go on from what another one has learned, if it is of the same; else begin anew."""
