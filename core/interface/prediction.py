"""What a predictor promises: where joint actions would lead, and what of it is tabulated.

Conventions are those of `spaces`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

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

    def rows(self, indices: IntArray) -> tuple[IntArray, IntArray]:
        """Return the rows ``(m,)`` of `own` and of `shared` for joint-action indices ``(m,)``."""
        local = indices // self.divisor % (len(self.own_rows) or len(self.own))
        own = self.own_rows[local] if len(self.own_rows) else local
        return own, self.shared_rows[indices] if len(self.shared_rows) else indices

    def states(self, indices: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of joint-action indices ``(m,)``."""
        own_rows, shared_rows = self.rows(indices)
        return np.concatenate([self.own[own_rows], self.shared[shared_rows]], axis=1)


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


class Tables(ABC):
    """Next states, and perhaps rewards, of all joint actions at once: of few agents."""

    rewarded: bool = True
    """Whether there is a table of rewards, too."""

    @abstractmethod
    def blocks(self, agent: int) -> Blocks:
        """Return the next states of an agent for all ``A ** n`` joint actions."""

    def reward_table(self) -> FloatArray:
        """Return the rewards ``(A ** n,)`` of all joint actions, as `Prediction.rewards` gives."""
        raise TypeError(f"{type(self).__name__} has no table of rewards")


class Prediction(ABC):
    """What joint actions taken now would lead to. Valid until the scenario's next step.

    `states` is all that is needed. What else a prediction knows it says by its other methods; where
    they return None, whoever asks does without or says so.
    `nested_agents.scenarios.checking` compares them with `states`.
    """

    @cached_property
    def alike(self) -> IntArray | None:
        """``(G, L)`` for every robot-action index the first one that comes to the same.

        The evaluator ``best-response`` tries only that; None: it is not known which do.
        """
        return None

    @abstractmethod
    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own variables ``(n, m, n_own)`` of all agents, shared ones ``(G, m, d - n_own)``.

        See `states_by_group`, which does without.
        """
        return None

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``: to decide by rewards."""
        return None

    def of(self, agent: int) -> Prediction:
        """Return what an agent predicts itself: the same, unless agents perceive for themselves."""
        return self

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from where a joint action ``(n,)`` leads in one decision.

        It knows rewards and goes on likewise: what plans of several decisions need.
        """
        return None

    def tables(self) -> Tables | None:
        """Return tables of all joint actions, which the evaluator ``exact`` reads."""
        return None


class Unpredicted(Prediction):
    """What agents decide by who predict nothing: they value their actions where they are."""

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Refuse to predict.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError("nothing is predicted here: the scenario has no method predict")


UNPREDICTED = Unpredicted()
"""The only one that there need be."""


def rewards_of(prediction: Prediction, joint_actions: IntArray) -> FloatArray:
    """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``.

    Raises
    ------
    ValueError
        If none are predicted.
    """
    rewards = prediction.rewards(joint_actions)
    if rewards is None:
        raise ValueError(f"{type(prediction).__name__} predicts no rewards")
    return rewards


class EmbodiedPrediction(Prediction):
    """A prediction that believes in effects of wheels, and perhaps in constants."""

    groups: tuple[tuple[int, ...], ...]
    """Agents by body."""

    @abstractmethod
    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` would command."""

    @abstractmethod
    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact changes the bodies' twists, as predicted, ``(M, 3)``."""

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return what a joint action would lead to by choices of constants ``(k, c)``.

        Mean twists ``(k, K + M, 3)`` of what is moved, then of the bodies, see `Transition.twists`.
        """
        raise TypeError(f"{type(self).__name__} has no constants")


def first_alike(keys: IntArray | FloatArray) -> IntArray:
    """Return in every row of ``(G, L)`` the first column that holds the same."""
    return (keys[:, :, None] == keys[:, None, :]).argmax(axis=2)


def states_by_group(
    prediction: Prediction, joint_actions: IntArray, groups: tuple[tuple[int, ...], ...], n_own: int
) -> tuple[FloatArray, FloatArray]:
    """Return the own variables ``(n, m, n_own)`` and the shared ones ``(G, m, d - n_own)``."""
    states = prediction.states_by_group(joint_actions)
    if states is not None:
        return states
    agents = range(joint_actions.shape[1])
    each = np.stack([np.array(prediction.states(i, joint_actions)) for i in agents])
    firsts = [group[0] for group in groups]
    return each[:, :, :n_own], each[firsts, :, n_own:]
