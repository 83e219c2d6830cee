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
from functools import partial
from typing import Any, Literal

import numpy as np

from ..interface.measures import measures_of
from ..interface.prediction import Blocks, Prediction
from ..interface.scenario import EmbodiedScenario, Scenario, Transition
from ..interface.spaces import ActionSet, StateSpace
from ..numerics import FloatArray, IntArray

Granularity = Literal["actuator", "body", "team"]
"""What there is one agent for."""
MOST_ACTIONS = {"body": 4**4, "team": 4**6}
"""The most actions of a body, those of four wheels, and of a team."""
OF_JOINT_ACTIONS = ("rewards", "commands", "slips", "outcomes")
"""What a prediction may offer whose first argument are joint actions."""
OF_BODIES = ("nominal_effects", "constants", "levers")
"""What a scenario open to self-models, and perhaps to calibration, tells of its bodies."""


def join_agents(scenario: Scenario, agents: Granularity) -> Scenario:
    """Return a scenario as one of an agent for each of these; with ``actuator`` as it is.

    Raises
    ------
    ValueError
        As `joint_blocks`.
    """
    return scenario if agents == "actuator" else JointAgents(scenario, agents)


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


class JointAgents:
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
        single, space, groups = scenario.action_set, scenario.state_space, scenario.groups
        self.agents, self.blocks = joint_blocks(scenario.agents, groups, len(single), each)
        self.scenario, self.whole, n_block = scenario, each == "team", len(self.blocks[0])
        self.measures = measures_of(scenario.measures)
        self.horizon = getattr(scenario, "horizon", 1)
        self.groups = tuple((i,) for i in range(len(self.agents)))
        self._n_each = space.n_variables if self.whole else space.n_own
        of_block = [scenario.agents[i] for i in self.blocks[0]]
        if self.whole:
            self.roles = self.agents
        else:
            of_block = [agent.rpartition(".")[2] for agent in of_block]
            roles = scenario.roles
            self.roles = tuple("+".join(roles[i] for i in block) for block in self.blocks)
        repeated, shared = space.variables[: self._n_each], space.variables[self._n_each :]
        own = [replace(v, name=f"{agent}.{v.name}") for agent in of_block for v in repeated]
        name = f"joint {space.name}" if self.whole else f"bodies' {space.name}"
        self.state_space = StateSpace(name, (*own, *shared), 0 if self.whole else len(own))
        # Row c holds the actions of a block's agents of index c.
        shape = (len(single),) * n_block
        self._local = np.indices(shape).reshape(n_block, -1).T.copy()
        names = tuple("+".join(single.names[a] for a in row) for row in self._local)
        neutral = int(np.ravel_multi_index((single.neutral,) * n_block, shape))
        zeros = (0.0,) * len(names)
        self.action_set = ActionSet(names, zeros, zeros, neutral)
        if hasattr(scenario, "predict"):
            self.predict = self._predict
        if not self.whole and isinstance(scenario, EmbodiedScenario):
            for name in OF_BODIES:
                if hasattr(scenario, name):
                    setattr(self, name, getattr(scenario, name))
            self.predict_with = self._predict

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

    def _predict(self, *beliefs: Any) -> JointPrediction:
        """Predict from the present state, believing in effects and constants if they are given."""
        scenario: Any = self.scenario
        known = scenario.predict_with(*beliefs) if beliefs else scenario.predict()
        return JointPrediction(known, self)

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


class JointPrediction:
    """The prediction of a scenario of all agents, for those who act for blocks of them.

    It can do what the scenario's own can; one who acts for all has tables of next states, too.

    Parameters
    ----------
    prediction
        The scenario's own.
    joint
        The scenario as those who act see it.
    """

    def __init__(self, prediction: Prediction, joint: JointAgents) -> None:
        self._prediction: Any = prediction
        self._joint = joint

    def __getattr__(self, name: str) -> Any:
        """Return what the scenario's own prediction can do, for the actions of those who act."""
        own, joint = self._prediction, self._joint
        if name in OF_JOINT_ACTIONS:
            method = getattr(own, name)
            return lambda joint_actions, *rest: method(joint.actions(joint_actions), *rest)
        if name == "reward_table" and joint.whole:
            return partial(self.rewards, joint.every())
        # The tables of next states are used with those of rewards.
        if name == "blocks" and (joint.whole or hasattr(own, "reward_table")):
            return self._whole if joint.whole else self._by_body
        if name in ("groups", "reward_table"):
            return getattr(own, name)
        raise AttributeError(name)

    def _whole(self, agent: int) -> Blocks:
        """Return the next states of one who acts for all, of which no variable is its own alone."""
        return Blocks(np.zeros((1, 0)), self.states(agent, self._joint.every()), 1)

    def _by_body(self, agent: int) -> Blocks:
        """Return the next states of who acts for a body, for all joint actions."""
        blocks = [self._prediction.blocks(i) for i in self._joint.blocks[agent]]
        own = np.concatenate([b.own[b.own_rows] if len(b.own_rows) else b.own for b in blocks], 1)
        return replace(blocks[0], own=own, own_rows=np.zeros(0, dtype=np.int64))

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of who acts for a block, for actions ``(m, M)``."""
        actions = self._joint.actions(joint_actions)
        block = self._joint.blocks[agent]
        return self._joint.joined([self._prediction.states(i, actions) for i in block])
