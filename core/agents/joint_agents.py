"""One agent that acts for a block of agents: for the wheels of a robot, or for the whole team.

`JointAgents` shows a scenario as one of fewer agents. The action of each is the actions of all
agents of its block at once, their digits read as one number, so that joint actions keep their
indices. Everything else of this package works on it unchanged. There are two ways:

`per_robot`
    One agent per robot: the mapping that the paper's one agent per wheel stands against (X-B). Its
    state is the own variables of all its wheels and the variables that they share.
`single_agent`
    The one agent that Section VII compares with (Eq. 23). Its state is the states of all agents one
    after the other, its action one of ``|A| ** n``: practicable for few agents only.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, cast

import numpy as np

from ..interface.measures import measures_of
from ..interface.prediction import Blocks, Prediction
from ..interface.scenario import (
    EmbodiedScenario,
    Scenario,
    Transition,
    groups_of,
    joint_reward,
    roles_of,
)
from ..interface.spaces import ActionSet, StateSpace, Variable
from ..numerics.arrays import FloatArray, IntArray

MOST_ROBOT_ACTIONS = 4**4
"""The most actions of a robot that are still distinguished: those of four wheels."""
MOST_TEAM_ACTIONS = 4**6
"""The most joint actions of a team that are still named one by one."""


class JointAgents:
    """A scenario seen as that of one agent per block of agents; see `per_robot`, `single_agent`.

    Parameters
    ----------
    scenario
        The scenario of all agents.
    blocks
        The agents that each acts for: consecutive, equally many.
    agents, roles
        Names and roles of those who act.
    state_space
        Their state variables.
    whole
        Whether one acts for all and perceives every variable of each; if not, what the agents of a
        block share is perceived once.
    """

    def __init__(
        self,
        scenario: Scenario,
        blocks: Sequence[Sequence[int]],
        agents: tuple[str, ...],
        roles: tuple[str, ...],
        state_space: StateSpace,
        *,
        whole: bool = False,
    ) -> None:
        self.scenario, self.blocks, self.whole = scenario, blocks, whole
        self.agents, self.roles, self.state_space = agents, roles, state_space
        self.measures = measures_of(scenario)
        self.groups = tuple((i,) for i in range(len(agents)))
        single, space = scenario.action_set, scenario.state_space
        # Row c holds the actions of a block's agents of index c.
        rows = product(range(len(single)), repeat=len(blocks[0]))
        self._local = np.array(list(rows), dtype=np.int64)
        names = tuple("+".join(single.names[a] for a in row) for row in self._local)
        neutral = int(np.flatnonzero((self._local == single.neutral).all(axis=1))[0])
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral)
        self._n_each = space.n_variables if whole else space.n_own

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode; return the states of those who act."""
        return self._states(self.scenario.reset(seed, episode))

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out the actions of those who act."""
        transition = self.scenario.step(self.actions(joint_action))
        reward = joint_reward(transition.reward, self.blocks)
        return replace(transition, states=self._states(transition.states), reward=reward)

    def predict(self) -> JointPrediction:
        """Predict from the present state."""
        return self.prediction_of(self.scenario.predict())

    def prediction_of(self, prediction: Prediction) -> JointPrediction:
        """Return the scenario's own prediction for those who act, with what it can do."""
        kind = JointPrediction
        if hasattr(prediction, "rewards" if self.whole else "reward_table"):
            kind = TabulatedJointPrediction
        elif self.whole:
            kind = BlocksJointPrediction
        elif hasattr(prediction, "rewards"):
            kind = RewardedJointPrediction
        return kind(prediction, self)

    def actions(self, joint_actions: IntArray) -> IntArray:
        """Return the actions ``(..., n)`` of all agents for those of who acts for them."""
        shape = (*joint_actions.shape[:-1], len(self.scenario.agents))
        return self._local[joint_actions].reshape(shape)

    def every(self) -> IntArray:
        """Return all actions ``(A, 1)`` of one who acts alone."""
        return np.arange(len(self._local))[:, None]

    def joined(self, parts: Sequence[FloatArray]) -> FloatArray:
        """Return states of who acts for the states of its agents, variables last."""
        own = [part[..., : self._n_each] for part in parts]
        return np.concatenate([*own, parts[0][..., self._n_each :]], axis=-1)

    def _states(self, states: FloatArray) -> FloatArray:
        return np.array([self.joined([states[i] for i in block]) for block in self.blocks])


class EmbodiedJointAgents(JointAgents):
    """The same of a scenario that is open to self-models."""

    @property
    def nominal_effects(self) -> tuple[FloatArray, ...]:
        """Per body the effect of its wheel speeds on its twist."""
        return cast(EmbodiedScenario, self.scenario).nominal_effects

    @property
    def constants(self) -> tuple[str, ...]:
        """Names of the constants that can be calibrated, if any."""
        return getattr(self.scenario, "constants", ())

    @property
    def levers(self) -> FloatArray:
        """Speed per turning rate of what is pushed and of the bodies."""
        return cast(Any, self.scenario).levers

    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> JointPrediction:
        """Predict from the present state, believing in these effects and constants."""
        given = () if constants is None else (constants,)
        return self.prediction_of(cast(Any, self.scenario).predict_with(effects, *given))


class JointPrediction:
    """The prediction of a scenario of all agents, for those who act for blocks of them.

    Parameters
    ----------
    prediction
        The scenario's own.
    joint
        The scenario as those who act see it.
    """

    def __init__(self, prediction: Prediction, joint: JointAgents) -> None:
        self._prediction, self._joint = prediction, joint

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of who acts for a block, for actions ``(m, M)``."""
        actions = self._joint.actions(joint_actions)
        block = self._joint.blocks[agent]
        return self._joint.joined([self._prediction.states(i, actions) for i in block])

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Wheels by body."""
        return cast(Any, self._prediction).groups

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds that a joint action ``(M,)`` would command."""
        actions = self._joint.actions(joint_action)
        return cast(Any, self._prediction).commands(actions)

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact is predicted to change the bodies' twists, ``(M, 3)``."""
        actions = self._joint.actions(joint_action)
        return cast(Any, self._prediction).slips(actions)

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return what a joint action ``(M,)`` would lead to under constants ``(k, n)``."""
        actions = self._joint.actions(joint_action)
        return cast(Any, self._prediction).outcomes(actions, constants)


class RewardedJointPrediction(JointPrediction):
    """The same of a prediction that knows the reward."""

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, M)``."""
        actions = self._joint.actions(joint_actions)
        return cast(Any, self._prediction).rewards(actions)


class BlocksJointPrediction(JointPrediction):
    """The same with tables of next states: of one who acts for all, they need none below."""

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of who acts for a block, for all joint actions."""
        if self._joint.whole:  # no variable is its own alone
            return Blocks(np.zeros((1, 0)), self.states(0, self._joint.every()), 1)
        tables = cast(Any, self._prediction)
        blocks = [tables.blocks(i) for i in self._joint.blocks[agent]]
        own = [b.own[b.own_rows] if len(b.own_rows) else b.own for b in blocks]
        return replace(
            blocks[0], own=np.concatenate(own, axis=1), own_rows=np.zeros(0, dtype=np.int64)
        )


class TabulatedJointPrediction(BlocksJointPrediction, RewardedJointPrediction):
    """The same with tables of next states and of the reward."""

    def reward_table(self) -> FloatArray:
        """Return the predicted rewards of all joint actions by index."""
        if self._joint.whole:
            return self.rewards(self._joint.every())
        return cast(Any, self._prediction).reward_table()


def per_robot(scenario: Scenario) -> JointAgents:
    """Return a scenario as one of one agent per robot.

    Raises
    ------
    ValueError
        If groups differ in size, or have more than `MOST_ROBOT_ACTIONS` actions.
    """
    blocks, names, roles = groups_of(scenario), scenario.agents, roles_of(scenario)
    space, actions = scenario.state_space, len(scenario.action_set)
    sizes = {len(block) for block in blocks}
    if len(sizes) > 1:
        raise ValueError(f"robots: of {sorted(sizes)} wheels, allowed: equally many")
    if actions ** max(sizes) > MOST_ROBOT_ACTIONS:
        raise ValueError(
            f"robots: {actions} ** {max(sizes)} actions each, allowed: {MOST_ROBOT_ACTIONS} "
            "or fewer"
        )
    own = _named((names[i].rpartition(".")[2] for i in blocks[0]), space.own)
    return (EmbodiedJointAgents if isinstance(scenario, EmbodiedScenario) else JointAgents)(
        scenario,
        blocks,
        tuple(robot_of(names[block[0]]) for block in blocks),
        tuple("+".join(roles[i] for i in block) for block in blocks),
        StateSpace(f"robots' {space.name}", (*own, *space.shared), len(own)),
    )


def single_agent(scenario: Scenario) -> JointAgents:
    """Return a scenario as one of a single agent.

    Raises
    ------
    ValueError
        If there are more than `MOST_TEAM_ACTIONS` joint actions.
    """
    n, actions, space = len(scenario.agents), len(scenario.action_set), scenario.state_space
    if actions**n > MOST_TEAM_ACTIONS:
        raise ValueError(
            f"single agent: {actions} ** {n} actions, allowed: {MOST_TEAM_ACTIONS} or fewer"
        )
    joint = StateSpace(f"joint {space.name}", _named(scenario.agents, space.variables))
    one = ("single",)
    return JointAgents(scenario, (range(n),), one, one, joint, whole=True)


def robot_of(agent: str) -> str:
    """Return the robot's part of a wheel's name, or the name if it has none.

    >>> robot_of("robot1.front-left"), robot_of("a")
    ('robot1', 'a')
    """
    return agent.rpartition(".")[0] or agent


def _named(agents: Iterable[str], variables: Sequence[Variable]) -> tuple[Variable, ...]:
    return tuple(replace(v, name=f"{agent}.{v.name}") for agent in agents for v in variables)
