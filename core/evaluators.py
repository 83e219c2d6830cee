"""The values of an agent's own actions, over what the agents below it may do (Section V).

Agent i proposes each of its actions; the actions above are fixed, the unseen maintain, and the
joint actions of the agents below are tried. Their next states are predicted and valued, and the
values are gathered per own action: by their maximum, their mean, or their mean weighted with how
often the agents below were seen to act so. Evaluators differ in which joint actions they try.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from .arrays import FloatArray, IntArray
from .hierarchy import Hierarchy
from .protocols import Prediction
from .rules import RuleBase

Rule = Literal["value", "reward", "reward-and-value"]

MOST_JOINT_ACTIONS = 4**12
"""The most that one agent enumerates: beyond, the tables do not fit into memory."""


@dataclass
class Counts:
    """What a team has evaluated so far."""

    joint_actions: int = 0
    """Joint actions tried."""
    rule_evaluations: int = 0
    """Joint actions tried times the rules of the rule base that valued each."""
    weight_updates: int = 0
    """Consequent weights changed by learning."""


class Evaluator(Protocol):
    """Values the actions of one agent."""

    def values(
        self,
        agent: int,
        joint_action: IntArray,
        theta: FloatArray,
        prediction: Prediction,
        frequencies: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent`.

        Parameters
        ----------
        agent
            The deciding agent.
        joint_action
            ``(n,)`` decided actions above, neutral elsewhere.
        theta
            ``(n_rules,)`` the agent's consequent weights.
        prediction
            Predicts next states and rewards.
        frequencies
            ``(n, A)`` how often each agent was seen to take each action, rows summing to one.
        rng
            Source of randomness.
        """
        ...


def _combinations(agents: tuple[int, ...], n_actions: int) -> IntArray:
    """Return all joint actions ``(A ** k, k)`` of k agents, in lexicographic order."""
    if not agents:
        return np.zeros((1, 0), dtype=np.int64)
    grid = np.indices((n_actions,) * len(agents)).reshape(len(agents), -1)
    return np.ascontiguousarray(grid.T, dtype=np.int64)


def _weights(frequencies: FloatArray, below: tuple[int, ...], tried: IntArray) -> FloatArray:
    """Return the probability ``(m,)`` of joint actions ``(m, k)`` of the agents below, scaled."""
    weights = np.ones(len(tried))
    for column, agent in enumerate(below):
        weights *= frequencies[agent, tried[:, column]]
    return weights / weights.sum()


class _Gathering:
    """What the evaluators share: the rule of decision and the gathering over the agents below."""

    def __init__(
        self,
        rules: RuleBase,
        hierarchy: Hierarchy,
        n_actions: int,
        rule: Rule,
        others: Literal["max", "mean", "observed"],
        discount: float,
    ) -> None:
        self.rules, self.hierarchy, self.n_actions = rules, hierarchy, n_actions
        self.rule, self.others, self.discount = rule, others, discount
        self.counts = Counts()

    def _count(self, joint_actions: int) -> None:
        self.counts.joint_actions += joint_actions
        if self.rule != "reward":
            self.counts.rule_evaluations += joint_actions * self.rules.n_rules

    def _by_states(
        self,
        agent: int,
        joint_action: IntArray,
        tried: IntArray,
        theta: FloatArray,
        prediction: Prediction,
    ) -> FloatArray:
        """Value ``(A, m)`` each own action with each of the joint actions `tried` ``(m, k)``."""
        a = self.n_actions
        joint = np.tile(joint_action, (a * len(tried), 1))
        joint[:, agent] = np.repeat(np.arange(a), len(tried))
        joint[:, list(self.hierarchy.below(agent))] = np.tile(tried, (a, 1))
        self._count(len(joint))
        rewards = values = None
        if self.rule != "value":
            rewards = prediction.rewards(joint)
        if self.rule != "reward":
            values = self.rules.values(theta, prediction.states(agent, joint))
        return self._combine(rewards, values).reshape(a, -1)

    def _combine(self, rewards: FloatArray | None, values: FloatArray | None) -> FloatArray:
        if rewards is None or values is None:
            combined = values if rewards is None else rewards
            assert combined is not None
            return combined
        return rewards + self.discount * values

    def _gather(self, values: FloatArray, weights: FloatArray | None) -> FloatArray:
        if self.others == "max":
            return values.max(axis=1)
        return values.mean(axis=1) if weights is None else values @ weights


class ExactEnumeration(_Gathering):
    """Tries every joint action of the agents below: ``A ** (1 + len(below))`` per agent.

    If all agents together try at least as many joint actions as there are, next states are taken
    from a table of all, else they are predicted for the joint actions that are tried.

    Raises
    ------
    ValueError
        If an agent would have to try more than `MOST_JOINT_ACTIONS`.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        n, a = len(self.hierarchy), self.n_actions
        for i, name in enumerate(self.hierarchy.agents):
            free = 1 + len(self.hierarchy.below(i))
            if a**free > MOST_JOINT_ACTIONS:
                raise ValueError(
                    f"decision.evaluator: agent {name!r} would try {a} ** {free} joint actions, "
                    f"exact enumeration allows {MOST_JOINT_ACTIONS}; use sampling"
                )
        self._tried = [_combinations(self.hierarchy.below(i), a) for i in range(n)]
        self._tabulated = self.hierarchy.joint_actions(a) >= a**n
        if not self._tabulated:
            return
        self._places = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
        # Code offsets (A, A ** k): own action by joint action of the agents below.
        self._offsets = [
            np.arange(a)[:, None] * self._places[i]
            + (self._tried[i] @ self._places[list(self.hierarchy.below(i))])[None, :]
            for i in range(n)
        ]

    def values(
        self,
        agent: int,
        joint_action: IntArray,
        theta: FloatArray,
        prediction: Prediction,
        frequencies: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent`, see `Evaluator.values`."""
        below, tried = self.hierarchy.below(agent), self._tried[agent]
        weights = _weights(frequencies, below, tried) if self.others == "observed" else None
        if self._tabulated:
            table = self._by_codes(agent, joint_action, theta, prediction)
        else:
            table = self._by_states(agent, joint_action, tried, theta, prediction)
        return self._gather(table, weights)

    def _by_codes(
        self, agent: int, joint_action: IntArray, theta: FloatArray, prediction: Prediction
    ) -> FloatArray:
        fixed = joint_action.copy()
        fixed[[agent, *self.hierarchy.below(agent)]] = 0
        codes = (self._offsets[agent] + int(fixed @ self._places)).ravel()
        self._count(len(codes))
        rewards = values = None
        if self.rule != "value":
            rewards = prediction.reward_table()[codes]
        if self.rule != "reward":
            values = self.rules.block_values(theta, prediction.blocks(agent), codes)
        return self._combine(rewards, values).reshape(self.n_actions, -1)


class Sampling(_Gathering):
    """Tries a random sample of the joint actions below, the same ones for every own action.

    Drawn with equal chance, or from the observed frequencies if others are "observed" (then the
    plain mean estimates the weighted one). With no more joint actions than samples, all are tried.
    """

    def __init__(self, samples: int, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        self.samples = samples

    def values(
        self,
        agent: int,
        joint_action: IntArray,
        theta: FloatArray,
        prediction: Prediction,
        frequencies: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return the value ``(A,)`` of each action of `agent`, see `Evaluator.values`."""
        below, a = self.hierarchy.below(agent), self.n_actions
        weights = None
        if a ** len(below) <= self.samples:
            tried = _combinations(below, a)
            if self.others == "observed":
                weights = _weights(frequencies, below, tried)
        elif self.others == "observed":
            ladder = frequencies[list(below)].cumsum(axis=1)[:, :-1]
            draws = rng.random((self.samples, len(below), 1))
            tried = (draws >= ladder).sum(axis=2)
        else:
            tried = rng.integers(a, size=(self.samples, len(below)))
        table = self._by_states(agent, joint_action, tried, theta, prediction)
        return self._gather(table, weights)
