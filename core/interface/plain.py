"""Predictions of users' plain classes, which inherit nothing of ours.

Optional methods of such a class are asked for by name here and nowhere else.
"""

from __future__ import annotations

from typing import Any

from ..numerics import FloatArray, IntArray
from .prediction import Blocks, Prediction, Tables
from .spaces import real_copy


def as_prediction(thing: Any) -> Prediction | None:
    """Return a prediction: the thing itself, or an adapter of a plain object."""
    if thing is None or isinstance(thing, Prediction):
        return thing
    return PlainPrediction(thing)


class PlainPrediction(Prediction, Tables):
    """Adapter for a prediction that does not inherit from `Prediction`.

    Parameters
    ----------
    plain
        Object with ``states(agent, joint_actions)``, and optionally the other methods of
        `Prediction` and `Tables`.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._has_tables = getattr(plain, "blocks", None) is not None
        self.alike = getattr(plain, "alike", None)

    @property
    def rewarded(self) -> bool:  # type: ignore[override]  # depends on the object
        """Whether there is a table of rewards."""
        return getattr(self.plain, "reward_table", None) is not None

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`."""
        return real_copy(self.plain.states(agent, joint_actions), "predicted states")

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own and shared variables, if the user's object has the method."""
        method = getattr(self.plain, "states_by_group", None)
        if method is None or (parts := method(joint_actions)) is None:
            return None
        own, shared = parts
        return real_copy(own, "predicted states"), real_copy(shared, "predicted states")

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return rewards, if the user's object predicts them."""
        method = getattr(self.plain, "rewards", None)
        if method is None or (rewards := method(joint_actions)) is None:
            return None
        return real_copy(rewards, "predicted rewards")

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from the states after a joint action, if there is one."""
        method = getattr(self.plain, "after", None)
        return None if method is None else as_prediction(method(joint_action))

    def tables(self) -> Tables | None:
        """Return tables, if the user's object has them."""
        return self if self._has_tables else None

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of an agent for all joint actions."""
        blocks: Blocks = self.plain.blocks(agent)
        return blocks

    def reward_table(self) -> FloatArray:
        """Return the rewards of all joint actions."""
        return real_copy(self.plain.reward_table(), "predicted rewards")
