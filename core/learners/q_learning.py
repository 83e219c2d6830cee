"""Q-learning: values of states and actions, learned from the best action that could follow.

It is for state spaces that hold what has been chosen beside the situation it was chosen in: there
the value of a state is the value of an action (Watkins and Dayan 1992).
"""

from itertools import product
from typing import ClassVar, Literal

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.settings import Positive
from ..rules.rule_base import RuleBase
from .online import OneStep, OneStepSettings


class QLearningSettings(OneStepSettings):
    """Q-learning, for state spaces that hold the actions taken."""

    kind: Literal["q-learning"] = "q-learning"
    factory: ClassVar[str] = f"{__name__}:QLearning"
    step_size: Positive = 0.3
    """alpha, divided by the squared length of the feature vector."""


class QLearning(OneStep):
    """TD(0) whose target is the greatest value over the actions in the state that was entered.

    With x the situation of a state and u the actions that it holds, on entering (x', u') after
    (x, u)::

        delta = R(x, u) + gamma max_v f(x', v) - f(x, u)
        theta = theta + alpha delta phi(x, u) / |phi(x, u)|^2

    Where u holds the actions of several agents, the maximum is over all their joint actions: the
    team Q-learning of agents that are paid together. It takes as many values as there are.

    Raises
    ------
    ValueError
        If the state space holds no actions.
    """

    def __init__(self, settings: QLearningSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        if not rules.actions:
            raise ValueError(
                "learner.kind = 'q-learning': the state space holds no actions to maximise over, "
                "use td-lambda"
            )
        self._columns = sorted(rules.actions)
        centres = [rules.partitions[column].centres for column in self._columns]
        self._choices = np.array(list(product(*centres)))

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(self.theta, states, rewards, None)
        if entered is not None:
            met = np.repeat(entered[:, None], len(self._choices), axis=1)
            met[:, :, self._columns] = self._choices
            delta += self.discount * self.rules.each(self.of_agents(self.theta), met).max(axis=1)
        return self._step(states, delta)
