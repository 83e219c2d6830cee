"""Predictions of a learned predictor from one situation."""

from typing import Any

import numpy as np

from ..interface.prediction import Prediction, first_alike
from ..numerics import FloatArray, IntArray


class LearnedPrediction(Prediction):
    """Predicts from one situation; see `Prediction`.

    Parameters
    ----------
    predictor
        A `LearnedPredictor`.
    present
        ``(n, d)`` present states of all agents.

    Attributes
    ----------
    alike
        ``(G, L)`` first equivalent robot-action index; None if groups differ in size.
    """

    def __init__(self, predictor: Any, present: FloatArray) -> None:
        self._predictor = predictor
        self.present = present
        self._reached = predictor.reached(present)
        self._last: tuple[bytes, tuple[FloatArray, FloatArray]] | None = None
        n, a, _ = self._reached.shape
        same = (self._reached[:, :, None] == self._reached[:, None]).all(axis=3)
        level = same.argmax(axis=2) if predictor.own_rules else np.tile(np.arange(a), (n, 1))
        joint_actions = predictor.joint_actions
        if joint_actions is not None:
            groups = np.array(predictor.groups)
            places = a ** np.arange(joint_actions.shape[1])[::-1]
            self.alike = first_alike(level[groups[:, None], joint_actions[None]] @ places)

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return own variables ``(n, m, n_own)`` and shared ones ``(G, m, d - n_own)``."""
        key = joint_actions.tobytes()
        if self._last is None or self._last[0] != key:
            own = self._reached[np.arange(joint_actions.shape[1]), joint_actions]
            drivers = self._predictor.group_drivers(own, joint_actions)
            shared = self._predictor.after(self.present, drivers)
            self._last = key, (np.ascontiguousarray(own.swapaxes(0, 1)), shared)
        return self._last[1]

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        own, shared = self.states_by_group(joint_actions)
        return np.concatenate([own[agent], shared[self._predictor.group_of[agent]]], axis=1)
