"""What an evaluator is, and what those that try joint actions share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..arrays import FloatArray, IntArray
from ..hierarchy import Hierarchy
from ..protocols import Prediction
from ..rules.rule_base import RuleBase

Rule = Literal["value", "reward", "reward-and-value"]
Others = Literal["max", "mean", "observed"]


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

    counts: Counts
    """What has been evaluated so far; the team adds what it learns."""

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


def combinations(agents: tuple[int, ...], n_actions: int) -> IntArray:
    """Return all joint actions ``(A ** k, k)`` of k agents, in lexicographic order."""
    if not agents:
        return np.zeros((1, 0), dtype=np.int64)
    grid = np.indices((n_actions,) * len(agents)).reshape(len(agents), -1)
    return np.ascontiguousarray(grid.T, dtype=np.int64)


def weights_of(frequencies: FloatArray, below: tuple[int, ...]) -> FloatArray:
    """Return the probability ``(A ** k,)`` of each joint action of the k agents below."""
    weights = np.ones(1)
    for agent in below:
        weights = np.multiply.outer(weights, frequencies[agent]).ravel()
    return weights / weights.sum()


class Gathering:
    """What the evaluators share: the rule of decision and the gathering over the agents below."""

    def __init__(
        self,
        rules: RuleBase,
        hierarchy: Hierarchy,
        n_actions: int,
        rule: Rule,
        others: Others,
        discount: float,
    ) -> None:
        self.rules, self.hierarchy, self.n_actions = rules, hierarchy, n_actions
        self.rule, self.others, self.discount = rule, others, discount
        self.counts = Counts()

    def count(self, joint_actions: int) -> None:
        """Note that joint actions have been valued."""
        self.counts.joint_actions += joint_actions
        if self.rule != "reward":
            self.counts.rule_evaluations += joint_actions * self.rules.n_rules

    def indifferent(self, theta: FloatArray) -> bool:
        """Return whether every action must come to zero: nothing is learned yet, or ever."""
        return self.rule == "value" and not theta[:64].any() and not theta.any()

    def by_states(
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
        self.count(len(joint))
        rewards = values = None
        if self.rule != "value":
            rewards = prediction.rewards(joint)
        if self.rule != "reward":
            values = self.rules.values(theta, prediction.states(agent, joint))
        return self.combine(rewards, values).reshape(a, -1)

    def combine(self, rewards: FloatArray | None, values: FloatArray | None) -> FloatArray:
        """Return what the rule of decision makes of predicted rewards and values."""
        if rewards is None or values is None:
            combined = values if rewards is None else rewards
            assert combined is not None
            return combined
        return rewards + self.discount * values

    def gather(self, values: FloatArray, weights: FloatArray | None) -> FloatArray:
        """Return per row ``(A, m)`` the maximum, mean or weighted mean."""
        if self.others == "max":
            return values.max(axis=1)
        return values.mean(axis=1) if weights is None else values @ weights
