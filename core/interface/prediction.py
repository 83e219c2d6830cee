"""What a predictor promises: the next states that joint actions would lead to.

Conventions. ``n`` agents, ``d`` state variables, ``A`` actions. A joint action is an integer array
``(n,)`` in agent order. Its *joint-action index* is that array read as a number in base ``A``, the
first agent being the most significant digit; tables of all joint actions are in the order of this
index. Groups are blocks of consecutive agents that move one body (the wheels of a robot); the
digits of one group read as a number are its *robot-action index*.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..numerics import FloatArray, IntArray


@dataclass(frozen=True)
class Blocks:
    """Next states of one agent for all joint actions, in their two blocks.

    Compiled kernels read the tables without looking at their sizes.
    `nested_agents.scenarios.checking.checker` does look.
    """

    own: FloatArray
    """``(K, n_own)`` own variables, one row per robot-action index of the agent's group of ``w``
    agents; fewer with `own_rows`, or if there are no own variables: then one row will do."""
    shared: FloatArray
    """``(R, d - n_own)`` shared variables, one row per joint-action index; fewer with
    `shared_rows`."""
    divisor: int
    """``A`` to the power of the number of agents behind the group: the robot-action index of
    joint-action index ``c`` is ``c // divisor % A ** w``."""
    own_rows: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """``(A ** w,)`` the row of `own` of every robot-action index, where several lead to one; empty:
    each has its row."""
    shared_rows: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """``(A ** n,)`` the row of `shared` of every joint-action index; empty: each has its row."""
    alone: bool = False
    """Whether own variables are those that the group would reach alone, which is an approximation
    where others matter to them. If not, the blocks give for every index exactly what
    `Prediction.states` gives; if so, of the shared variables only."""

    def states(self, indices: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of joint-action indices ``(m,)``."""
        local = indices // self.divisor % (len(self.own_rows) or len(self.own))
        own = self.own[self.own_rows[local] if len(self.own_rows) else local]
        shared = self.shared[self.shared_rows[indices] if len(self.shared_rows) else indices]
        return np.concatenate([own, shared], axis=1)


@runtime_checkable
class Prediction(Protocol):
    """What joint actions taken now would lead to. Valid until the scenario's next step.

    Only `states` is required. What a prediction may have besides is asked for by name, and where it
    is missing, what needs it does without or says so. `nested_agents.scenarios.checking` compares
    it with `states`.

    ``states_by_group(joint_actions)``
        Own variables ``(n, m, n_own)`` of all agents and shared ones ``(G, m, d - n_own)`` of all
        groups. `states_by_group` asks for it, where the values of many agents are pooled.
    ``rewards(joint_actions)``
        Rewards ``(m,)`` of joint actions ``(m, n)``: what deciding by rewards needs.
    ``after(joint_action)``
        The prediction from where a joint action ``(n,)`` leads in one decision, which knows the
        reward and goes on likewise: what plans of several decisions need.
    ``alike``
        ``(G, L)`` for every robot-action index of every group the first one that comes to the same:
        the evaluator ``best-response`` tries only that.
    ``best_responses(rules)``
        `BestResponses` by such rules, or None: what the evaluator ``best-response`` comes to where
        all agents are bodies of their own that hear all and decide by the value of the team. They
        are the very same joint actions, with the same draws, but sooner.
    ``blocks(agent)``
        `Blocks` of an agent's next states for all ``A ** n`` joint actions. The evaluator ``exact``
        reads them where few agents are free.
    ``reward_table()``
        Rewards ``(A ** n,)`` of all joint actions by index, as `rewards` gives them. The evaluator
        ``exact`` needs it besides ``blocks``, except to decide by the deciding agent's value alone.
    """

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""


class Exploring(NamedTuple):
    """How agents explore by random actions that are held, as compiled code takes it."""

    memory: FloatArray
    """``(1 + 2 n,)``, changed: per agent, behind the first, decisions left and the action held."""
    chance: float
    """Probability with which an agent begins to hold one; below zero: nobody does."""
    stop: float
    """Probability with which it ends."""


NOT_EXPLORING = Exploring(np.zeros(0), -1.0, 1.0)
"""Nobody explores."""
BestResponses = Callable[[FloatArray, IntArray, IntArray, Exploring, np.random.Generator], IntArray]
"""Returns the joint action ``(n,)`` by the agents' weights ``(n, n_rules)``, a plan ``(n,)`` to
start from, the order of decision ``(n,)``, how they explore, and a source of randomness."""


def first_alike(keys: IntArray | FloatArray) -> IntArray:
    """Return in every row of ``(G, L)`` the first column that holds the same."""
    return (keys[:, :, None] == keys[:, None, :]).argmax(axis=2)


def states_by_group(
    prediction: Prediction, joint_actions: IntArray, groups: tuple[tuple[int, ...], ...], n_own: int
) -> tuple[FloatArray, FloatArray]:
    """Return the own variables ``(n, m, n_own)`` and the shared ones ``(G, m, d - n_own)``."""
    own_way = getattr(prediction, "states_by_group", None)
    if own_way is not None:
        return own_way(joint_actions)
    each = range(joint_actions.shape[1])
    states = np.stack([prediction.states(i, joint_actions) for i in each])
    return states[:, :, :n_own], states[[group[0] for group in groups], :, n_own:]
