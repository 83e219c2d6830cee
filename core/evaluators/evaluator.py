"""What an evaluator is and what it is asked, and what those share that try joint actions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, cast

import numpy as np

from ..arrays import FloatArray, IntArray
from ..hierarchy import Hierarchy
from ..protocols import Prediction, RewardPrediction
from ..settings import Settings

if TYPE_CHECKING:
    from ..rules.rule_base import RuleBase

Rule = Literal["value", "reward", "reward-and-value"]
"""By what a joint action is valued."""
Teammates = Literal["best-response", "uniform", "empirical"]
"""The teammate model: what the agents below are expected to do."""


class Deliberation(NamedTuple):
    """What an agent knows when it decides.

    Attributes
    ----------
    agent
        The deciding agent.
    joint_action
        ``(n,)`` the actions decided above; neutral elsewhere.
    prediction
        Predicts what joint actions would lead to.
    weights
        The consequent weights ``(n_rules,)`` of every agent, in agent order.
    frequencies
        ``(n, A)`` how often each agent was seen to take each action, rows summing to one.
    rng
        Source of randomness.
    """

    agent: int
    joint_action: IntArray
    prediction: Prediction
    weights: Sequence[FloatArray]
    frequencies: FloatArray
    rng: np.random.Generator

    @property
    def own_weights(self) -> FloatArray:
        """The consequent weights of the deciding agent."""
        return self.weights[self.agent]


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

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        ...


@dataclass(frozen=True)
class DecisionProblem:
    """What all decisions of a team have in common.

    Attributes
    ----------
    rules
        The agents' rule base.
    hierarchy
        Who is below whom.
    n_actions
        Actions A of every agent.
    groups
        Agents by body.
    additive
        Whether predictions can be had to first order, as sums over groups.
    rule, teammates
        By what a joint action is valued, and what the agents below are expected to do.
    discount
        Weight of the value, where it is added to the reward.
    """

    rules: RuleBase
    hierarchy: Hierarchy
    n_actions: int
    groups: tuple[tuple[int, ...], ...]
    additive: bool
    rule: Rule
    teammates: Teammates
    discount: float


class EvaluatorSettings(Settings):
    """What the settings of all evaluators inherit."""

    kind: str = ""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        raise TypeError(f"evaluator {self.kind!r} says not how it is built")


def combinations(agents: tuple[int, ...], n_actions: int) -> IntArray:
    """Return all joint actions ``(A ** k, k)`` of k agents, in lexicographic order."""
    if not agents:
        return np.zeros((1, 0), dtype=np.int64)
    grid = np.indices((n_actions,) * len(agents)).reshape(len(agents), -1)
    return np.ascontiguousarray(grid.T, dtype=np.int64)


def probabilities_of(frequencies: FloatArray, below: tuple[int, ...]) -> FloatArray:
    """Return the probability ``(A ** k,)`` of each joint action of the k agents below."""
    probabilities = np.ones(1)
    for agent in below:
        probabilities = np.multiply.outer(probabilities, frequencies[agent]).ravel()
    return probabilities / probabilities.sum()


class Aggregation:
    """What evaluators share: the decision rule, and the aggregation over teammates."""

    def __init__(self, problem: DecisionProblem) -> None:
        self.problem = problem
        self.rules, self.hierarchy = problem.rules, problem.hierarchy
        self.n_actions = problem.n_actions
        self.counts = Counts()

    def count(self, joint_actions: int) -> None:
        """Note that joint actions have been valued."""
        self.counts.joint_actions += joint_actions
        if self.problem.rule != "reward":
            self.counts.rule_evaluations += joint_actions * self.rules.n_rules

    def indifferent(self, weights: FloatArray) -> bool:
        """Return whether every action must come to zero: nothing is learned yet, or ever."""
        return self.problem.rule == "value" and not weights[:64].any() and not weights.any()

    def by_states(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value ``(A, m)`` each own action with each of the joint actions `tried` ``(m, k)``."""
        agent, prediction, a = deliberation.agent, deliberation.prediction, self.n_actions
        joint = np.tile(deliberation.joint_action, (a * len(tried), 1))
        joint[:, agent] = np.repeat(np.arange(a), len(tried))
        joint[:, list(self.hierarchy.below(agent))] = np.tile(tried, (a, 1))
        self.count(len(joint))
        rewards = values = None
        if self.problem.rule != "value":
            rewards = cast(RewardPrediction, prediction).rewards(joint)
        if self.problem.rule != "reward":
            states = prediction.states(agent, joint)
            values = self.rules.values(deliberation.own_weights, states)
        return self.combine(rewards, values).reshape(a, -1)

    def combine(self, rewards: FloatArray | None, values: FloatArray | None) -> FloatArray:
        """Return what the decision rule makes of predicted rewards and values."""
        if rewards is None or values is None:
            combined = values if rewards is None else rewards
            assert combined is not None
            return combined
        return rewards + self.problem.discount * values

    def aggregate(self, values: FloatArray, probabilities: FloatArray | None) -> FloatArray:
        """Return per row ``(A, m)`` the maximum, mean or weighted mean, by the teammate model."""
        if self.problem.teammates == "best-response":
            return values.max(axis=1)
        return values.mean(axis=1) if probabilities is None else values @ probabilities
