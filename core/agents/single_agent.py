"""The one agent that Section VII compares with: joint state, ``|A| ** n`` actions (Eq. 23).

`SingleAgent` shows a scenario of n agents as one of a single agent. Its state is the states of all
agents one after the other, its action a joint-action index; everything else of this package works
on it unchanged. It is practicable for few agents only.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import cast

import numpy as np

from ..interface.protocols import (
    Blocks,
    Prediction,
    RewardPrediction,
    Scenario,
    Transition,
    joint_reward,
    measures_of,
)
from ..interface.spaces import ActionSet, StateSpace
from ..numerics.arrays import FloatArray, IntArray

MOST_ACTIONS = 4**6
"""The most joint actions that are still named one by one."""


class SingleAgent:
    """A scenario seen as that of one agent.

    Parameters
    ----------
    scenario
        The scenario of n agents.

    Raises
    ------
    ValueError
        If there are more than `MOST_ACTIONS` joint actions.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.measures = measures_of(scenario)
        n, single = len(scenario.agents), scenario.action_set
        if len(single) ** n > MOST_ACTIONS:
            raise ValueError(
                f"single agent: {len(single)} ** {n} actions, allowed: {MOST_ACTIONS} or fewer"
            )
        # Row c holds the joint action of joint-action index c.
        self._joint = np.array(list(product(range(len(single)), repeat=n)), dtype=np.int64)
        names = tuple("+".join(single.names[a] for a in row) for row in self._joint)
        neutral = int(np.flatnonzero((self._joint == single.neutral).all(axis=1))[0])
        zeros = (0.0,) * len(names)
        self.agents = ("single",)
        self.groups = ((0,),)
        self.action_set = ActionSet(names, zeros, zeros, neutral)
        space = scenario.state_space
        variables = tuple(
            replace(v, name=f"{agent}.{v.name}")
            for agent in scenario.agents
            for v in space.variables
        )
        self.state_space = StateSpace(f"joint {space.name}", variables)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode; return the joint state ``(1, n * d)``."""
        return self.scenario.reset(seed, episode).reshape(1, -1)

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out the joint action of index ``joint_action[0]``."""
        transition = self.scenario.step(self._joint[joint_action[0]])
        reward = joint_reward(transition.reward, (range(len(self.scenario.agents)),))
        return replace(transition, states=transition.states.reshape(1, -1), reward=reward)

    def predict(self) -> SingleAgentPrediction:
        """Predict from the present state."""
        prediction = self.scenario.predict()
        rewarded = hasattr(prediction, "rewards")
        kind = RewardedSingleAgentPrediction if rewarded else SingleAgentPrediction
        return kind(prediction, self._joint)


class SingleAgentPrediction:
    """The prediction of a scenario of n agents, for joint states and joint-action indices.

    Parameters
    ----------
    prediction
        The scenario's own.
    joint
        ``(A ** n, n)`` all joint actions by index.
    """

    def __init__(self, prediction: Prediction, joint: IntArray) -> None:
        self._prediction, self._joint = prediction, joint

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next joint states ``(m, n * d)`` for joint-action indices ``(m, 1)``."""
        joint = self._joint[joint_actions[:, 0]]
        parts = [self._prediction.states(i, joint) for i in range(joint.shape[1])]
        return np.concatenate(parts, axis=1)

    def blocks(self, agent: int) -> Blocks:
        """Return the next joint states of all indices; no variable is the agent's own alone."""
        every = np.arange(len(self._joint))[:, None]
        return Blocks(np.zeros((1, 0)), self.states(0, every), 1)


class RewardedSingleAgentPrediction(SingleAgentPrediction):
    """The same of a prediction that knows the reward."""

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint-action indices ``(m, 1)``."""
        return cast(RewardPrediction, self._prediction).rewards(self._joint[joint_actions[:, 0]])

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards of all joint-action indices."""
        return cast(RewardPrediction, self._prediction).rewards(self._joint)
