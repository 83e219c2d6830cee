"""What joint actions lead to: exactly if joints do what they are believed to do.

A decision turns every joint by its speed times the period, or up to its limit. What each of its
actions would turn it by is computed once; a joint action is then one posture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.numerics.arrays import FloatArray, IntArray
from .kinematics import postures_of
from .variables import ChainStates
from .view import ChainView


@dataclass(frozen=True)
class Premises:
    """What predictions of one arm have in common.

    Attributes
    ----------
    states
        What joints perceive.
    length
        Of a link [m].
    top_speed
        Greatest speed of a joint [rad/s].
    reward
        ``reward(distance (m,), approach (m,)) -> (m,)``.
    """

    states: ChainStates
    length: float
    top_speed: float
    reward: Callable[[FloatArray, FloatArray], FloatArray]


class ChainPrediction:
    """Prediction of one decision, of all agents at once.

    It knows rewards and serves self-models, every joint being a body.

    Parameters
    ----------
    premises
        What predictions of the arm have in common.
    angles
        ``(n,)`` the present posture [rad].
    speeds
        ``(n, A)`` speed that each action of each joint commands [rad/s].
    turns
        ``(n, A)`` by how much it turns the joint [rad].
    goal
        ``(2,)`` [m].
    before
        Present distance of the tip from the goal [m].
    onward
        ``onward(angles (n,), speeds (n,), before)``: the prediction from another posture.
    """

    def __init__(
        self,
        premises: Premises,
        angles: FloatArray,
        speeds: FloatArray,
        turns: FloatArray,
        goal: FloatArray,
        before: float,
        onward: Callable[[FloatArray, FloatArray, float], ChainPrediction],
    ) -> None:
        self.premises, self.angles, self.speeds, self.turns = premises, angles, speeds, turns
        self.goal, self.before, self._onward = goal, before, onward
        self.shares = speeds / premises.top_speed
        """The speeds as fractions of the greatest."""
        self._joints = np.arange(len(angles))

    def seen(self, joint_actions: IntArray) -> ChainView:
        """Return the situations after joint actions ``(m, n)``."""
        angles = self.angles + self.turns[self._joints, joint_actions]
        places = postures_of(angles, self.premises.length)
        speeds = self.shares[self._joints, joint_actions]
        return ChainView(places, angles, speeds, self.goal, self.before)

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return self.premises.states.predicted(self.seen(joint_actions), agent, 1)[0]

    def states_of_all(self, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(n, m, d)`` of all agents for joint actions ``(m, n)``."""
        return self.premises.states.predicted(self.seen(joint_actions), 0, len(self.angles))

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        view = self.seen(joint_actions)
        return self.premises.reward(view.distance, view.approach)

    def after(self, joint_action: IntArray) -> ChainPrediction:
        """Return the prediction from where a joint action ``(n,)`` leads in one decision."""
        reached = self.seen(joint_action[None])
        return self._onward(reached.angles[0], self.commands(joint_action), reached.distance[0])

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Agents by body: every joint alone."""
        return tuple((i,) for i in range(len(self.angles)))

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the joint speeds ``(n,)`` that a joint action ``(n,)`` would command [rad/s]."""
        return self.speeds[self._joints, joint_action]

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact changes the joints' motion ``(n, 3)``: not at all."""
        return np.zeros((len(self.angles), 3))
