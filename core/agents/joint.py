"""Who the agents are: one for every actuator, one for every body, or one for the whole team.

A scenario has an agent for every actuator: a wheel, a joint, a player of a game. `join_agents`
shows it as one of fewer agents. The action of each of these is the actions of all agents of its
block at once, their digits read as one number, so that joint actions keep their indices.
Everything else of this package, hierarchies too, works on it unchanged.

`body`
    One agent for every body: the mapping that the paper's one agent per wheel stands against (X-B).
    Its state is the own variables of its actuators and the variables that they share.
`team`
    The one agent that Section VII compares with (Eq. 23). Its state is the states of all agents one
    after the other, its action one of ``|A| ** n``: practicable for few agents only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..interface.plain import as_prediction
from ..interface.prediction import (
    Blocks,
    EmbodiedPrediction,
    Prediction,
    Tables,
    rewards_of,
)
from ..interface.scenario import Embodiment, Scenario, Transition, checked_scenario
from ..interface.spaces import ActionSet, StateSpace
from ..numerics import FloatArray, IntArray

Granularity = Literal["actuator", "body", "team"]
"""What there is one agent for."""
MOST_ACTIONS = {"body": 4**4, "team": 4**6}
"""The most actions of a body, those of four wheels, and of a team."""


def join_agents(scenario: object, agents: Granularity) -> Scenario:
    """Return a scenario as one of an agent for each of these; with ``actuator`` as it is.

    Raises
    ------
    ValueError
        As `joint_blocks`.
    """
    world = checked_scenario(scenario)
    return world if agents == "actuator" else JointAgents(world, agents)


def joint_blocks(
    agents: Sequence[str], groups: Sequence[Sequence[int]], n_actions: int, each: Granularity
) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """Return the names of those who act, and which agents of a scenario each acts for.

    Parameters
    ----------
    agents, groups
        Names of the scenario's agents, and these by body.
    n_actions
        Actions of each of them.
    each
        What there is one agent for.

    Raises
    ------
    ValueError
        If bodies differ in their number of actuators, or there are more actions than
        `MOST_ACTIONS`.

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
    if n_actions ** sizes[0] > MOST_ACTIONS[each]:
        raise ValueError(
            f"agents = {each!r}: {n_actions} ** {sizes[0]} actions each, allowed: "
            f"{MOST_ACTIONS[each]} or fewer"
        )
    names = ("single",) if each == "team" else tuple(body_of(agents[b[0]]) for b in blocks)
    return names, blocks


def body_of(agent: str) -> str:
    """Return the body's part of an actuator's name, or the name if it has none.

    >>> body_of("robot1.front-left"), body_of("a")
    ('robot1', 'a')
    """
    return agent.rpartition(".")[0] or agent


class JointAgents(Scenario):
    """A scenario seen as that of one agent per block of agents; see `join_agents`.

    Parameters
    ----------
    scenario
        The scenario of all agents.
    each
        What there is one agent for. One for the team perceives every variable of each; what the
        agents of a body share is perceived once.
    """

    def __init__(self, scenario: Scenario, each: Granularity) -> None:
        single = scenario.action_set
        space = scenario.state_space
        self.agents, self.blocks = joint_blocks(scenario.agents, scenario.groups, len(single), each)
        self.scenario = scenario
        self.whole = each == "team"
        self.measures = scenario.measures
        self.horizon = scenario.horizon
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
        sources = [v.name for _ in of_block for v in repeated] + [v.name for v in shared]
        variables = (*own, *shared)
        taken = [v.name for v, n in zip(variables, sources, strict=True) if n in space.actions]
        self.state_space = StateSpace(
            name, variables, 0 if self.whole else len(own), actions=tuple(taken)
        )
        # Row c holds the actions of a block's agents of index c.
        shape = (len(single),) * len(self.blocks[0])
        self._local = np.indices(shape).reshape(len(shape), -1).T.copy()
        names = tuple("+".join(single.names[a] for a in row) for row in self._local)
        neutral = int(np.ravel_multi_index((single.neutral,) * len(shape), shape))
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode; return the states of those who act."""
        return self._states(self.scenario.reset(seed, episode))

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out the actions of those who act."""
        transition = self.scenario.step(self.actions(joint_action))
        reward = transition.reward
        if np.ndim(reward):  # each acts for the mean reward of its agents
            reward = np.array([np.take(reward, block).mean() for block in self.blocks])
        return replace(transition, states=self._states(transition.states), reward=reward)

    @property
    def predicts(self) -> bool:
        """Whether the scenario predicts."""
        return self.scenario.predicts

    @property
    def lacks_prediction(self) -> str:
        """Why it predicts nothing."""
        return self.scenario.lacks_prediction

    def predict(self) -> JointPrediction | None:
        """Predict from the present state, if the scenario does."""
        prediction = as_prediction(self.scenario.predict())
        return None if prediction is None else JointPrediction(prediction, self)

    def embodiment(self) -> Embodiment | None:
        """Return the scenario's bodies, if there is an agent for each of them."""
        bodies = None if self.whole else self.scenario.embodiment()
        return None if bodies is None else JointEmbodiment(bodies, self)

    def actions(self, joint_actions: IntArray) -> IntArray:
        """Return the actions ``(..., n)`` of all agents, of the actions of those who act."""
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


class JointPrediction(Prediction, Tables):
    """The prediction of a scenario of all agents, for those who act for blocks of them.

    One who acts for all has tables of next states, also where the scenario's own has none.

    Parameters
    ----------
    prediction
        The scenario's own.
    joint
        The scenario as those who act see it.
    """

    def __init__(self, prediction: Prediction, joint: JointAgents) -> None:
        self._prediction = prediction
        self._joint = joint
        self._tables = prediction.tables()

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of who acts for a block, for actions ``(m, M)``."""
        actions = self._joint.actions(joint_actions)
        block = self._joint.blocks[agent]
        return self._joint.joined([np.array(self._prediction.states(i, actions)) for i in block])

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards of actions ``(m, M)``, if the scenario predicts them."""
        return self._prediction.rewards(self._joint.actions(joint_actions))

    @cached_property
    def rewarded(self) -> bool:  # type: ignore[override]  # known of a prediction, not of its class
        """Whether there is a table of rewards."""
        if self._joint.whole:
            return self.rewards(self._joint.every()[:1]) is not None
        return self._tables is not None and self._tables.rewarded

    def tables(self) -> Tables | None:
        """Return tables: of who acts for all, or the scenario's own that have rewards, too."""
        return self if self._joint.whole or self.rewarded else None

    def blocks(self, agent: int) -> Blocks:
        """Return the next states of who acts for a block, for all joint actions."""
        if self._joint.whole:  # no variable is its own alone
            return Blocks(np.zeros((1, 0)), self.states(agent, self._joint.every()), 1)
        assert self._tables is not None
        blocks = [self._tables.blocks(i) for i in self._joint.blocks[agent]]
        own = np.concatenate([b.own[b.own_rows] if len(b.own_rows) else b.own for b in blocks], 1)
        return replace(blocks[0], own=own, own_rows=np.zeros(0, dtype=np.int64))

    def reward_table(self) -> FloatArray:
        """Return the rewards of all joint actions."""
        if self._joint.whole:
            return rewards_of(self, self._joint.every())
        assert self._tables is not None
        return self._tables.reward_table()


class JointEmbodiment(Embodiment):
    """The bodies of a scenario, of which each is one agent."""

    def __init__(self, bodies: Embodiment, joint: JointAgents) -> None:
        self._bodies = bodies
        self._joint = joint
        self.nominal_effects = bodies.nominal_effects
        self.constants = bodies.constants
        self.levers = bodies.levers

    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> EmbodiedPrediction:
        """Predict, believing in these effects and constants."""
        return JointBodiesPrediction(self._bodies.predict_with(effects, constants), self._joint)


class JointBodiesPrediction(JointPrediction, EmbodiedPrediction):
    """The same, for self-models and calibration."""

    def __init__(self, prediction: EmbodiedPrediction, joint: JointAgents) -> None:
        super().__init__(prediction, joint)
        self._bodies = prediction
        self.groups = prediction.groups

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds that the actions of bodies would command."""
        return self._bodies.commands(self._joint.actions(joint_action))

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact changes the bodies' twists."""
        return self._bodies.slips(self._joint.actions(joint_action))

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return what the actions of bodies would lead to by choices of constants."""
        return self._bodies.outcomes(self._joint.actions(joint_action), constants)
