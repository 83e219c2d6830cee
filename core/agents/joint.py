"""Granularity of agents: one agent for every actuator, for every body, or for the whole team.

A scenario has an agent for every actuator: a wheel, a joint, a player of a game. `join_agents`
returns a scenario with fewer agents, each of which acts for a block of the original agents. Its
action is the tuple of their actions, read as the digits of one number, so that joint-action indices
remain the same.

`body`
    One agent for every body, the alternative to the paper's one agent per wheel (Section X-B). Its
    state consists of the own variables of its actuators and their shared variables.
`team`
    The single agent of Section VII (Eq. 23). Its state consists of the states of all agents, and it
    has ``|A| ** n`` actions, which is feasible for few agents only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..interface.abilities import Embodiment, horizon_of
from ..interface.prediction import Assumptions, EmbodiedPrediction, Prediction
from ..interface.scenario import Scenario, Transition, checked_scenario
from ..interface.spaces import ActionSet, StateSpace
from ..numerics import FloatArray, IntArray
from ..search.enumeration import combinations

Granularity = Literal["actuator", "body", "team"]
"""Part of a team that one agent controls."""
MAX_ACTIONS = {"body": 4**4, "team": 4**6}
"""Maximum number of actions of an agent for a body, as with four wheels, and for a team."""


def join_agents(scenario: object, agents: Granularity) -> Scenario:
    """Return a scenario with agents of some granularity.

    Raises
    ------
    ValueError
        If `joint_blocks` refuses the granularity; one line.
    """
    checked = checked_scenario(scenario)
    return checked if agents == "actuator" else JointAgents(checked, agents)


def joint_blocks(
    agents: Sequence[str], groups: Sequence[Sequence[int]], n_actions: int, each: Granularity
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """Return the names of joint agents, and the block of agents that each acts for.

    Parameters
    ----------
    agents, groups
        Names of the scenario's agents, and their indices by body.
    n_actions
        Number of actions of each of them.
    each
        Granularity of the joint agents.

    Raises
    ------
    ValueError
        If bodies differ in their number of actuators, or there are more than `MAX_ACTIONS`.

    Examples
    --------
    >>> joint_blocks(["a.left", "a.right", "b.left", "b.right"], [(0, 1), (2, 3)], 4, "body")
    (('a', 'b'), ((0, 1), (2, 3)))
    """
    if each == "actuator":
        return tuple(agents), tuple((i,) for i in range(len(agents)))
    blocks = (tuple(range(len(agents))),) if each == "team" else tuple(map(tuple, groups))
    sizes = sorted({len(block) for block in blocks})
    if len(sizes) > 1:
        raise ValueError(f"agents = 'body': bodies of {sizes} actuators, allowed: equally many")
    if n_actions ** sizes[0] > MAX_ACTIONS[each]:
        raise ValueError(
            f"agents = {each!r}: {n_actions} ** {sizes[0]} actions each, allowed: "
            f"{MAX_ACTIONS[each]} or fewer"
        )
    names = ("single",) if each == "team" else tuple(body_of(agents[b[0]]) for b in blocks)
    return names, blocks


def body_of(agent: str) -> str:
    """Return the name of the body of an actuator, or its own name without a body.

    >>> body_of("robot1.front-left"), body_of("a")
    ('robot1', 'a')
    """
    return agent.rpartition(".")[0] or agent


class JointAgents(Scenario):
    """A scenario with one agent per block of agents, see `join_agents`.

    Parameters
    ----------
    scenario
        Scenario of all agents.
    each
        Granularity. The agent of a team observes all variables of all agents; the agent of a body
        observes their shared variables once.
    """

    def __init__(self, scenario: Scenario, each: Granularity) -> None:
        single = scenario.action_set
        space = scenario.state_space
        self.agents, self.blocks = joint_blocks(scenario.agents, scenario.groups, len(single), each)
        self.scenario = scenario
        self.whole = each == "team"
        self.measures = scenario.measures
        self.horizon = horizon_of(scenario)
        if not self.whole and isinstance(scenario, Embodiment):
            self.nominal_effects = scenario.nominal_effects
            self.constants = scenario.constants
            self.levers = scenario.levers
            self.regression_shapes = scenario.regression_shapes
        self._n_each = space.n_variables if self.whole else space.n_own
        of_block = [scenario.agents[i] for i in self.blocks[0]]
        if self.whole:
            self.roles = self.agents
        else:
            of_block = [agent.rpartition(".")[2] for agent in of_block]
            roles = scenario.roles
            self.roles = tuple("+".join(roles[i] for i in block) for block in self.blocks)
        repeated = space.variables[: self._n_each]
        shared = space.variables[self._n_each :]
        own = [replace(v, name=f"{agent}.{v.name}") for agent in of_block for v in repeated]
        name = f"joint {space.name}" if self.whole else f"bodies' {space.name}"
        variables = (*own, *shared)
        taken = [v.name for v in variables if v.name.rpartition(".")[2] in space.actions]
        self.state_space = StateSpace(
            name, variables, 0 if self.whole else len(own), actions=tuple(taken)
        )
        # Row c holds the actions of a block's agents of index c.
        self._local = combinations(self.blocks[0], len(single))
        names = tuple("+".join(single.names[a] for a in row) for row in self._local)
        neutral = int(np.flatnonzero((self._local == single.neutral).all(axis=1))[0])
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode; return the states of the joint agents."""
        return self._states(self.scenario.reset(seed, episode))

    def step(self, joint_action: IntArray) -> Transition:
        """Execute the actions of the joint agents."""
        transition = self.scenario.step(self.actions(joint_action))
        reward = transition.reward
        if np.ndim(reward):  # the reward of a joint agent is the mean of its block
            reward = np.array([np.take(reward, block).mean() for block in self.blocks])
        return replace(transition, states=self._states(transition.states), reward=reward)

    @property
    def lacks_prediction(self) -> str:
        """Reason why the scenario has no prediction."""
        return self.scenario.lacks_prediction

    def predict(self) -> JointPrediction | None:
        """Return the prediction from the present state, if there is one."""
        prediction = self.scenario.predict()
        if prediction is None:
            return None
        if not self.whole and isinstance(prediction, EmbodiedPrediction):
            return JointBodiesPrediction(prediction, self)
        return JointPrediction(prediction, self)

    def actions(self, joint_actions: IntArray) -> IntArray:
        """Return the actions ``(..., n)`` of all agents for the actions of joint agents."""
        shape = (*joint_actions.shape[:-1], len(self.scenario.agents))
        return self._local[joint_actions].reshape(shape)

    def joined(self, parts: Sequence[FloatArray]) -> FloatArray:
        """Return the states of a joint agent from those of its block, variables last."""
        own = [part[..., : self._n_each] for part in parts]
        return np.concatenate([*own, parts[0][..., self._n_each :]], axis=-1)

    def _states(self, states: FloatArray) -> FloatArray:
        return np.array([self.joined([states[i] for i in block]) for block in self.blocks])


class JointPrediction(Prediction):
    """Prediction of a scenario for joint agents.

    Parameters
    ----------
    prediction
        Prediction of the original scenario.
    joint
        Scenario of the joint agents.
    """

    def __init__(self, prediction: Prediction, joint: JointAgents) -> None:
        self._prediction = prediction
        self._joint = joint
        self.repeats = prediction.repeats

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of a joint agent for joint actions ``(m, M)``."""
        actions = self._joint.actions(joint_actions)
        block = self._joint.blocks[agent]
        return self._joint.joined([np.array(self._prediction.states(i, actions)) for i in block])

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards of joint actions ``(m, M)``, if the scenario predicts them."""
        return self._prediction.rewards(self._joint.actions(joint_actions))


class JointBodiesPrediction(JointPrediction, EmbodiedPrediction):
    """Prediction of bodies for self-models and calibration, for joint agents."""

    def __init__(self, prediction: EmbodiedPrediction, joint: JointAgents) -> None:
        super().__init__(prediction, joint)
        self._bodies = prediction
        self.groups = prediction.groups

    def assuming(self, assumptions: Assumptions) -> JointBodiesPrediction:
        """Return the prediction under other assumptions."""
        return JointBodiesPrediction(self._bodies.assuming(assumptions), self._joint)

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds that the actions of bodies command."""
        return self._bodies.commands(self._joint.actions(joint_action))

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return the change of the bodies' twists by contact."""
        return self._bodies.slips(self._joint.actions(joint_action))

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return predicted twists for choices of constants."""
        return self._bodies.outcomes(self._joint.actions(joint_action), constants)

    def pose_samples(
        self, joint_action: IntArray, info: Mapping[str, FloatArray]
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return features and targets of all regressions of poses."""
        return self._bodies.pose_samples(self._joint.actions(joint_action), info)
