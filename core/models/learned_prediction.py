"""Predictions of a learned predictor from one situation."""

from functools import cached_property
from typing import Any

import numpy as np

from ..interface.prediction import Blocks, Prediction, Tables, first_alike
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
        self._first: IntArray | None = None
        n, a, _ = self._reached.shape
        same = (self._reached[:, :, None] == self._reached[:, None]).all(axis=3)
        self._level = same.argmax(axis=2) if predictor.own_rules else np.tile(np.arange(a), (n, 1))
        if predictor.digits.size:
            groups = np.array(predictor.groups)
            digits = predictor.digits
            places = a ** np.arange(digits.shape[1])[::-1]
            self._first = first_alike(self._level[groups[:, None], digits[None]] @ places)

    @cached_property
    def alike(self) -> IntArray | None:
        """The first equivalent robot-action index, see `Prediction`."""
        return self._first

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


class TabulatedPrediction(LearnedPrediction, Tables):
    """A learned prediction of few agents, with tables of all joint actions."""

    @cached_property
    def _table(self) -> tuple[FloatArray, IntArray]:
        """Shared variables ``(G, rows, s)``, and the row of every joint-action index."""
        p = self._predictor
        assert self._first is not None  # tables are of groups of equal size
        same = self._first[np.arange(len(p.groups)), p.local] @ p.divisors
        first, row = np.unique(same, return_index=True, return_inverse=True)[1:]
        return self.states_by_group(p.joint[first])[1], row

    rewarded = False

    def tables(self) -> Tables:
        """Return itself: it has tables of all joint actions."""
        return self

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of `agent` for all joint actions."""
        p = self._predictor
        shared, row = self._table
        g = p.group_of[agent]
        own_rows = self._level[agent][p.digits[:, p.groups[g].index(agent)]]
        own = self._reached[agent]
        if not own.shape[1]:
            own = own[:1]
            own_rows = own_rows[:0]
        return Blocks(own, shared[g], int(p.divisors[g]), own_rows, row)
