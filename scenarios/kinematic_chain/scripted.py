"""Scripted controllers of a kinematic chain, as baselines from robotics.

They are evaluators that a spec can name. They know the kinematics and the goal, and do not learn::

    [learner]
    kind = "frozen"
    decision.evaluator = "nested_agents.scenarios.kinematic_chain.scripted:DampedLeastSquares"

Joints decide in the order of the hierarchy. Each computes a turn, given the decisions of the joints
above, and takes the action with the nearest turn.

- `DampedLeastSquares` (Nakamura and Hanafusa 1986; Wampler 1986): with J the ``(2, k)`` Jacobian of
  the k free joints and e the remaining error of the tip, the turns are
  ``J' (J J' + damping^2)^-1 e``, scaled down to the speed limit of the fastest joint.
- `CyclicCoordinateDescent` (Wang and Chen 1991): each joint turns until the tip lies on the line
  from the joint to the goal.
"""

from abc import abstractmethod
from typing import Annotated

import numpy as np
from pydantic import Field

from ...core.interface.agents import Counts
from ...core.numerics import FloatArray
from ...core.search import EvaluatorSettings
from ...core.search.evaluator import DecisionContext, DecisionProblem, Evaluator
from .scenario import ChainPrediction
from .variables import forward_kinematics, jacobian


class _Scripted(Evaluator):
    """Base class: the action with the turn nearest to the desired one."""

    def __init__(self, settings: EvaluatorSettings, problem: DecisionProblem) -> None:
        self.settings = settings
        self.problem = problem
        self.counts = Counts()

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action, the negative distance from the desired turn.

        Raises
        ------
        ValueError
            If the scenario is not a kinematic chain.
        """
        prediction = context.prediction
        agent = context.agent
        if not isinstance(prediction, ChainPrediction):
            raise ValueError(
                f"learner.decision.evaluator: {type(self).__name__} needs a kinematic-chain"
            )
        above = list(self.problem.hierarchy.senders(agent))
        turns = np.zeros(len(prediction.angles))
        turns[above] = prediction.turns[above, context.joint_action[above]]
        places = forward_kinematics(prediction.angles + turns, prediction.arm.length)
        return -np.abs(prediction.turns[agent] - self._desired_turn(prediction, agent, places))

    @abstractmethod
    def _desired_turn(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
        """Return the desired turn of a joint [rad].

        `places` are the joints and the tip ``(n + 1, 2)`` after the turns of the joints above.
        """


class DampedLeastSquares(_Scripted):
    """Turns all free joints together along the damped least-squares solution."""

    class Settings(EvaluatorSettings):
        """The settings of the controller."""

        damping: Annotated[float, Field(gt=0)] = 0.05
        """Damping [m/rad], which limits turns of a stretched arm."""

    settings: Settings

    def _desired_turn(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
        above = list(self.problem.hierarchy.senders(agent))
        least = prediction.turns.min(axis=1)
        most = prediction.turns.max(axis=1)
        free = most > least
        free[above] = False
        if not free[agent]:
            return 0.0
        moves = jacobian(places)
        drift = np.where(free, 0.0, prediction.turns.mean(axis=1))
        drift[above] = 0.0
        error = prediction.goal - places[-1] - drift @ moves
        own = moves[free]
        square = own.T @ own + self.settings.damping**2 * np.eye(2)
        turns = own @ np.linalg.solve(square, error)
        reach = np.maximum(np.abs(least), np.abs(most))[free]
        slower = min(1.0, float((reach / np.maximum(np.abs(turns), 1e-12)).min()))
        return slower * float(turns[np.count_nonzero(free[:agent])])


class CyclicCoordinateDescent(_Scripted):
    """Turns one joint after another so that the tip points at the goal."""

    Settings = EvaluatorSettings

    def _desired_turn(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
        x, y = places[-1] - places[agent]
        ahead, aside = prediction.goal - places[agent]
        return float(np.arctan2(x * aside - y * ahead, x * ahead + y * aside))
