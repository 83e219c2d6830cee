"""Scripted controllers of a kinematic chain: what robotics would do, as controls of learning.

Both are evaluators, so that a spec can name them; they know the kinematics and the goal, and learn
nothing::

    [learner]
    kind = "frozen"
    decision.evaluator = "nested_agents.scenarios.kinematic_chain.scripted:DampedLeastSquares"

Joints decide in the order of the hierarchy. Each finds by how much it should turn, given what those
above it have decided, and takes the action that comes nearest to it.

- `DampedLeastSquares` (Nakamura and Hanafusa 1986; Wampler 1986): with J the ``(2, k)`` Jacobian of
  the k joints that are free and e what is left of the tip's error, the turns are
  ``J' (J J' + damping^2)^-1 e``, slowed down until the fastest joint can follow.
- `CyclicCoordinateDescent` (Wang and Chen 1991): each joint turns until the tip lies on the line
  from the joint to the goal.
"""

from abc import ABC, abstractmethod
from typing import Annotated

import numpy as np
from pydantic import Field

from ...core.evaluators import EvaluatorSettings
from ...core.evaluators.evaluator import DecisionProblem, Deliberation
from ...core.interface.agents import Counts
from ...core.numerics import FloatArray
from .scenario import ChainPrediction
from .variables import forward_kinematics, jacobian


class _Scripted(ABC):
    """What the two share: the action whose turn is nearest to the one that is wanted."""

    def __init__(self, settings: EvaluatorSettings, problem: DecisionProblem) -> None:
        self.settings = settings
        self.problem = problem
        self.counts = Counts()

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action: how near its turn comes, negative.

        Raises
        ------
        ValueError
            If the scenario is no kinematic chain.
        """
        prediction = deliberation.prediction
        agent = deliberation.agent
        if not isinstance(prediction, ChainPrediction):
            raise ValueError(
                f"learner.decision.evaluator: {type(self).__name__} moves a kinematic-chain only"
            )
        above = list(self.problem.hierarchy.senders(agent))
        turns = np.zeros(len(prediction.angles))
        turns[above] = prediction.turns[above, deliberation.joint_action[above]]
        places = forward_kinematics(prediction.angles + turns, prediction.arm.length)
        return -np.abs(prediction.turns[agent] - self._wanted(prediction, agent, places))

    @abstractmethod
    def _wanted(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
        """Return the turn that is wanted of a joint [rad].

        `places` are the joints and the tip ``(n + 1, 2)`` once those above have turned.
        """


class DampedLeastSquares(_Scripted):
    """Turns all free joints together along the damped least-squares solution."""

    class Settings(EvaluatorSettings):
        """The settings of the controller."""

        damping: Annotated[float, Field(gt=0)] = 0.05
        """In metres per radian: large where the arm is stretched and joints would race."""

    settings: Settings

    def _wanted(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
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
    """Turns one joint after the other towards the goal, as if the others stood still."""

    class Settings(EvaluatorSettings):
        """The settings of the controller: there is nothing to set."""

    def _wanted(self, prediction: ChainPrediction, agent: int, places: FloatArray) -> float:
        x, y = places[-1] - places[agent]
        ahead, aside = prediction.goal - places[agent]
        return float(np.arctan2(x * aside - y * ahead, x * ahead + y * aside))
