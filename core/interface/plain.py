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
    """A prediction of a user's plain class.

    Parameters
    ----------
    plain
        An object that has ``states(agent, joint_actions)``, and perhaps methods of the names that
        `Prediction` and `Tables` have.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._has_tables = getattr(plain, "blocks", None) is not None
        self.alike = getattr(plain, "alike", None)

    @property
    def rewarded(self) -> bool:  # type: ignore[override]  # of users' classes it is not known before
        """Whether there is a table of rewards."""
        return getattr(self.plain, "reward_table", None) is not None

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent`."""
        return real_copy(self.plain.states(agent, joint_actions), "predicted states")

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own and shared variables of all, if the user's object knows a way."""
        own_way = getattr(self.plain, "states_by_group", None)
        if own_way is None or (parts := own_way(joint_actions)) is None:
            return None
        own, shared = parts
        return real_copy(own, "predicted states"), real_copy(shared, "predicted states")

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return rewards, if the user's object predicts them."""
        own_way = getattr(self.plain, "rewards", None)
        if own_way is None or (rewards := own_way(joint_actions)) is None:
            return None
        return real_copy(rewards, "predicted rewards")

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from where a joint action leads, if it goes on."""
        own_way = getattr(self.plain, "after", None)
        return None if own_way is None else as_prediction(own_way(joint_action))

    def tables(self) -> Tables | None:
        """Return its tables, if it has such."""
        return self if self._has_tables else None

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of an agent for all joint actions."""
        blocks: Blocks = self.plain.blocks(agent)
        return blocks

    def reward_table(self) -> FloatArray:
        """Return the rewards of all joint actions."""
        return real_copy(self.plain.reward_table(), "predicted rewards")
