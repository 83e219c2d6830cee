"""One agent per robot: the mapping that the paper's one agent per wheel stands against (X-B).

`RobotAgents` shows a scenario as one whose agents drive whole robots. An agent's action is a
robot-action index: the actions of all its wheels at once. Its state is the own variables of all its
wheels and the variables that they share; everything else of this package works on it unchanged.
Joint actions keep their indices, as the digits of a robot's wheels read as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any, cast

import numpy as np

from ..interface.protocols import (
    Blocks,
    CalibratedScenario,
    EmbodiedPrediction,
    EmbodiedScenario,
    Prediction,
    RewardPrediction,
    Scenario,
    Transition,
    groups_of,
    joint_reward,
    measures_of,
    roles_of,
)
from ..interface.spaces import ActionSet, StateSpace
from ..numerics.arrays import FloatArray, IntArray

MOST_ACTIONS = 4**4
"""The most actions of a robot that are still distinguished: those of four wheels."""


class RobotAgents:
    """A scenario seen as that of one agent per group.

    Parameters
    ----------
    scenario
        The scenario of one agent per wheel.

    Raises
    ------
    ValueError
        If groups differ in size, or have more than `MOST_ACTIONS` actions.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.wheel_groups = groups_of(scenario)
        self.measures = measures_of(scenario)
        sizes = {len(group) for group in groups_of(scenario)}
        single, w = scenario.action_set, max(sizes)
        if len(sizes) > 1:
            raise ValueError(f"robots: of {sorted(sizes)} wheels, allowed: equally many")
        if len(single) ** w > MOST_ACTIONS:
            raise ValueError(
                f"robots: {len(single)} ** {w} actions each, allowed: {MOST_ACTIONS} or fewer"
            )
        # Row c holds the actions of a robot's wheels of robot-action index c.
        self._local = np.array(list(product(range(len(single)), repeat=w)), dtype=np.int64)
        names = tuple("+".join(single.names[a] for a in row) for row in self._local)
        neutral = int(np.flatnonzero((self._local == single.neutral).all(axis=1))[0])
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral)
        self.agents = tuple(robot_of(scenario.agents[group[0]]) for group in self.wheel_groups)
        self.groups = tuple((r,) for r in range(len(self.agents)))
        roles = roles_of(scenario)
        self.roles = tuple("+".join(roles[i] for i in group) for group in self.wheel_groups)
        space = scenario.state_space
        own = tuple(
            replace(v, name=f"{scenario.agents[wheel].rpartition('.')[2]}.{v.name}")
            for wheel in self.wheel_groups[0]
            for v in space.own
        )
        self.state_space = StateSpace(f"robots' {space.name}", (*own, *space.shared), len(own))

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode; return the states of the robots."""
        return self._joined(self.scenario.reset(seed, episode))

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a robot-action index per robot."""
        transition = self.scenario.step(self._local[joint_action].ravel())
        reward = joint_reward(transition.reward, self.wheel_groups)
        return replace(transition, states=self._joined(transition.states), reward=reward)

    def predict(self) -> RobotPrediction:
        """Predict from the present state."""
        return self.prediction_of(self.scenario.predict())

    def prediction_of(self, prediction: Prediction) -> RobotPrediction:
        """Return the scenario's own prediction for robots, with what it can do."""
        if hasattr(prediction, "reward_table"):
            return TabulatedRobotPrediction(prediction, self)
        if hasattr(prediction, "rewards"):
            return RewardedRobotPrediction(prediction, self)
        return RobotPrediction(prediction, self)

    def wheels(self, joint_actions: IntArray) -> IntArray:
        """Return the actions of all wheels ``(m, n)`` for robot-action indices ``(m, M)``."""
        return self._local[joint_actions].reshape(len(joint_actions), -1)

    def _joined(self, states: FloatArray) -> FloatArray:
        n_own = self.scenario.state_space.n_own
        rows = [
            np.concatenate([*(states[wheel, :n_own] for wheel in group), states[group[0], n_own:]])
            for group in self.wheel_groups
        ]
        return np.array(rows)


class EmbodiedRobotAgents(RobotAgents):
    """The same of a scenario that is open to self-models."""

    @property
    def nominal_effects(self) -> tuple[FloatArray, ...]:
        """Per body the effect of its wheel speeds on its twist."""
        return cast(EmbodiedScenario, self.scenario).nominal_effects

    @property
    def constants(self) -> tuple[str, ...]:
        """Names of the constants that can be calibrated, if any."""
        return self.scenario.constants if isinstance(self.scenario, CalibratedScenario) else ()

    @property
    def levers(self) -> FloatArray:
        """Speed per turning rate of what is pushed and of the bodies."""
        return cast(CalibratedScenario, self.scenario).levers

    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> RobotPrediction:
        """Predict from the present state, believing in these effects and constants."""
        if constants is None:
            prediction = cast(EmbodiedScenario, self.scenario).predict_with(effects)
        else:
            prediction = cast(CalibratedScenario, self.scenario).predict_with(effects, constants)
        return self.prediction_of(prediction)


def per_robot(scenario: Scenario) -> RobotAgents:
    """Return a scenario as one of one agent per robot."""
    embodied = isinstance(scenario, EmbodiedScenario)
    kind = EmbodiedRobotAgents if embodied else RobotAgents
    return kind(scenario)


class RobotPrediction:
    """The prediction of a scenario of wheels, for robots.

    Parameters
    ----------
    prediction
        The scenario's own.
    robots
        The scenario as robots see it.
    """

    def __init__(self, prediction: Prediction, robots: RobotAgents) -> None:
        self._prediction, self._robots = prediction, robots
        self._groups = robots.wheel_groups
        self._n_own = robots.scenario.state_space.n_own

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states of a robot for robot-action indices ``(m, M)``."""
        wheels = self._robots.wheels(joint_actions)
        parts = [self._prediction.states(wheel, wheels) for wheel in self._groups[agent]]
        own = [part[:, : self._n_own] for part in parts]
        return np.concatenate([*own, parts[0][:, self._n_own :]], axis=1)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Wheels by body."""
        return cast(EmbodiedPrediction, self._prediction).groups

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds that robot-action indices ``(M,)`` would command."""
        wheels = self._robots.wheels(joint_action[None])[0]
        return cast(EmbodiedPrediction, self._prediction).commands(wheels)

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact is predicted to change the bodies' twists, ``(M, 3)``."""
        wheels = self._robots.wheels(joint_action[None])[0]
        return cast(EmbodiedPrediction, self._prediction).slips(wheels)

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return what robot-action indices ``(M,)`` would lead to under constants ``(k, n)``."""
        wheels = self._robots.wheels(joint_action[None])[0]
        return cast(Any, self._prediction).outcomes(wheels, constants)


class RewardedRobotPrediction(RobotPrediction):
    """The same of a prediction that knows the reward."""

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards of robot-action indices ``(m, M)``."""
        return cast(RewardPrediction, self._prediction).rewards(self._robots.wheels(joint_actions))


class TabulatedRobotPrediction(RewardedRobotPrediction):
    """The same of a prediction that has tables of all joint actions."""

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of a robot for all joint actions."""
        tables = cast(Any, self._prediction)
        blocks = [tables.blocks(wheel) for wheel in self._groups[agent]]
        own = [b.own[b.own_rows] if len(b.own_rows) else b.own for b in blocks]
        return replace(
            blocks[0], own=np.concatenate(own, axis=1), own_rows=np.zeros(0, dtype=np.int64)
        )

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards of all joint actions by index."""
        return cast(Any, self._prediction).reward_table()


def robot_of(agent: str) -> str:
    """Return the robot's part of a wheel's name, or the name if it has none.

    >>> robot_of("robot1.front-left"), robot_of("a")
    ('robot1', 'a')
    """
    return agent.rpartition(".")[0] or agent
