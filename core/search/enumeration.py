"""Evaluators that try every joint action of the agents below, or a random sample of them.

``auto`` enumerates the joint actions of few agents, samples those of some, and plans for many. For
many agents, best responses around a plan reach greater values than a sample in half of its time.
"""

from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.prediction import Prediction, rewards_of, states_by_group
from ..numerics import FloatArray, IntArray
from ..values.rule_base import PooledWeights
from .evaluator import (
    EVALUATORS,
    Aggregation,
    DecisionContext,
    DecisionProblem,
    Evaluator,
    EvaluatorSettings,
)

MAX_JOINT_ACTIONS = 4**11
"""Maximum number of joint actions per own action; more would fill the memory."""


def combinations(agents: tuple[int, ...], n_actions: int) -> IntArray:
    """Return all joint actions ``(A ** k, k)`` of k agents, in lexicographic order.

    Raises
    ------
    ValueError
        If there are too many; raised before memory is allocated.
    """
    if n_actions ** len(agents) > MAX_JOINT_ACTIONS:
        raise ValueError(
            f"learner.decision.evaluator: {n_actions} ** {len(agents)} joint actions of "
            f"{len(agents)} agents would be tried, allowed {MAX_JOINT_ACTIONS}; use sampling"
        )
    k = len(agents)
    grid = np.indices((n_actions,) * k).reshape(k, n_actions**k)
    return np.ascontiguousarray(grid.T, dtype=np.int64)


Samples = Annotated[int, Field(ge=1, le=1_000_000)]


def probabilities_of(frequencies: FloatArray, below: tuple[int, ...]) -> FloatArray:
    """Return the probability ``(A ** k,)`` of each joint action of the k agents below."""
    probabilities = np.ones(1)
    for agent in below:
        probabilities = np.multiply.outer(probabilities, frequencies[agent]).ravel()
    return probabilities / probabilities.sum()


def exact_joint_actions(problem: DecisionProblem) -> int:
    """Return the number of joint actions that exact enumeration tries in a decision."""
    below = (len(problem.hierarchy.searched(i)) for i in problem.deciding)
    return sum(problem.n_actions ** (1 + k) for k in below)


class _JointOutcomes:
    """Predicted outcomes of all joint actions. Equivalent actions are predicted once.

    Parameters
    ----------
    problem
        Properties that all decisions of the team share.
    prediction
        Prediction of the decision.
    joint_actions
        ``(A ** n, n)`` all joint actions, in the order of their index.

    Attributes
    ----------
    distinct
        ``(m, n)`` joint actions without equivalent ones.
    rows
        ``(A ** n,)`` the distinct joint action that each joint action is equivalent to.
    values
        Mean values ``(m,)`` of several agents, and their weights; None before they are computed.
    """

    def __init__(
        self, problem: DecisionProblem, prediction: Prediction, joint_actions: IntArray
    ) -> None:
        self.problem = problem
        self.prediction = prediction
        self.distinct = joint_actions
        self.rows = np.arange(len(joint_actions))
        self.values: tuple[PooledWeights, FloatArray] | None = None
        alike = prediction.alike
        if alike is not None:
            rows = np.zeros(1, dtype=np.int64)
            n_rows = 1
            for group, equivalent in zip(problem.groups, alike, strict=True):
                first = equivalent[: problem.n_actions ** len(group)]
                number = (first == self.rows[: len(first)]).cumsum() - 1
                count = int(number[-1]) + 1
                rows = np.add.outer(rows * count, number[first]).ravel()
                n_rows *= count
            firsts = np.empty(n_rows, dtype=np.int64)
            firsts[rows[::-1]] = self.rows[::-1]
            self.rows = rows
            self.distinct = joint_actions[firsts]

    @cached_property
    def rewards(self) -> FloatArray:
        """Predicted rewards ``(m,)``."""
        return rewards_of(self.prediction, self.distinct)

    @cached_property
    def states(self) -> list[FloatArray]:
        """Predicted states ``(m, d)`` of every agent."""
        groups = self.problem.groups
        n_own = self.problem.rules.n_own
        own, shared = states_by_group(self.prediction, self.distinct, groups, n_own)
        return [
            np.concatenate([own[agent], of_group], axis=1)
            for group, of_group in zip(groups, shared, strict=True)
            for agent in group
        ]


class ExactEnumeration(Aggregation):
    """Evaluates every joint action of an agent and those below it, as in the paper.

    An agent tries ``A ** (1 + len(below))`` joint actions. If all agents together try at least as
    many as there are, all joint actions are predicted at once.

    Raises
    ------
    ValueError
        If an agent would have to try more than `MAX_JOINT_ACTIONS`, or the budget is below the
        joint actions of all agents.
    """

    name = "exact"

    def __init__(self, problem: DecisionProblem) -> None:
        super().__init__(problem)
        n, a = len(self.hierarchy), self.n_actions
        self.check_budget(exact_joint_actions(problem))
        self._below = [combinations(self.hierarchy.searched(i), a) for i in range(n)]
        self._every: IntArray | None = None
        """``(A ** n, n)`` all joint actions, if all are predicted at once."""
        self._indices: list[IntArray] = []
        """For every agent, what its own and lower actions add to the index of a joint action."""
        self._strides: list[IntArray] = []
        """For every agent, strides ``(n,)`` of the actions of all others in that index, and 0 for
        its own and those below."""
        self._last: _JointOutcomes | None = None
        if a**n <= min(self.hierarchy.count_joint_actions(a), MAX_JOINT_ACTIONS):
            self._every = combinations(tuple(range(n)), a)
            strides = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
            for agent in range(n):
                below = list(self.hierarchy.searched(agent))
                own = np.arange(a)[:, None] * strides[agent]
                self._indices.append((own + self._below[agent] @ strides[below]).ravel())
                others = strides.copy()
                others[[agent, *below]] = 0
                self._strides.append(others)

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = context.agent
        below = self.hierarchy.searched(agent)
        probabilities = None
        if self.problem.teammates == "empirical":
            probabilities = probabilities_of(context.frequencies, below)
        elif self.problem.teammates == "conditional":
            probabilities = np.stack([probabilities_of(rows, below) for rows in context.given])
        return self.aggregate(context, self._below[agent], probabilities)

    def worths(self, context: DecisionContext, tried: IntArray) -> FloatArray:
        """Return values ``(A, m)`` of own actions, each with joint actions `tried` ``(m, k)``."""
        if self._every is None:
            return super().worths(context, tried)
        if self._last is None or self._last.prediction is not context.prediction:
            self._last = _JointOutcomes(self.problem, context.prediction, self._every)
        outcomes = self._last
        agent = context.agent
        given = int(context.joint_action @ self._strides[agent])
        indices = self._indices[agent] + given
        self.count(agent, len(indices))
        rows = outcomes.rows[indices]
        worth = self.combine(
            lambda: outcomes.rewards[rows], lambda: self._values_of(context, outcomes, rows)
        )
        return worth.reshape(self.n_actions, -1)

    def _values_of(
        self, context: DecisionContext, outcomes: _JointOutcomes, rows: IntArray
    ) -> FloatArray:
        """Return the values ``(k,)`` of rows ``(k,)`` of the outcomes to the deciding agent.

        The mean over several agents is computed for all outcomes, once in a decision.
        """
        if len(self.concerned[context.agent]) > 1:
            pooled = self.pooled(context)
            if outcomes.values is None or outcomes.values[0] is not pooled:
                values = self.mean(pooled, outcomes.prediction, outcomes.distinct)
                outcomes.values = pooled, values
            return outcomes.values[1][rows]
        states = outcomes.states[context.agent]
        if len(rows) > len(states):
            return self.rules.values(context.own_weights, states)[rows]
        return self.rules.values(context.own_weights, states[rows])


class SamplingSettings(EvaluatorSettings):
    """Evaluate a random sample of the joint actions of the agents below."""

    kind: Literal["sampling"] = "sampling"
    factory: ClassVar[str] = f"{__name__}:Sampling"
    samples: Samples = 64
    """Sample size: joint actions of the agents below, evaluated with each own action."""


class Sampling(Aggregation):
    """Evaluates a random sample of the joint actions below, the same for every own action.

    The sample is uniform, or drawn by the empirical frequencies if these are the teammate model;
    the plain mean then estimates the weighted one. If there are no more joint actions than samples,
    all are evaluated.

    A budget reduces the samples. If an agent may try fewer joint actions than it has actions, it
    compares a random sample of its actions, each with one joint action of the agents below.

    Raises
    ------
    ValueError
        If the teammate model is conditional on the own action, or the budget is below one joint
        action for every agent.
    """

    name = "sampling"

    def __init__(self, settings: SamplingSettings, problem: DecisionProblem) -> None:
        super().__init__(problem)
        if problem.teammates == "conditional":
            raise ValueError(
                "learner.decision.teammates = 'conditional': sampling evaluates best-response, "
                "uniform, empirical; use exact"
            )
        a = self.n_actions
        below = map(len, map(self.hierarchy.searched, range(len(self.hierarchy))))
        self._shares = self.shares([a * min(settings.samples, a**k) for k in below], least=1)

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent.

        Actions that the budget leaves out have the value -inf.
        """
        below, a = self.hierarchy.searched(context.agent), self.n_actions
        share = self._shares[context.agent]
        if share < a:
            own = context.rng.choice(a, share, replace=False)
            tried = self._sample(context, 1)
            values = np.full(a, -np.inf)
            values[own] = self.worth(context, self.joint_actions(context, own, tried))
            return values
        if a ** len(below) > share // a:
            return self.aggregate(context, self._sample(context, share // a), None)
        probabilities = None
        if self.problem.teammates == "empirical":
            probabilities = probabilities_of(context.frequencies, below)
        return self.aggregate(context, combinations(below, a), probabilities)

    def _sample(self, context: DecisionContext, samples: int) -> IntArray:
        """Return sampled joint actions ``(samples, k)`` of the agents below."""
        below = self.hierarchy.searched(context.agent)
        if self.problem.teammates == "empirical":
            return self.sample(context.frequencies[list(below)], samples, context.rng)
        return context.rng.integers(self.n_actions, size=(samples, len(below)))


class ExactSettings(EvaluatorSettings):
    """Exact enumeration of the joint actions of the agents below."""

    kind: Literal["exact"] = "exact"

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return ExactEnumeration(problem)


class AutoSettings(EvaluatorSettings):
    """Exact enumeration for small teams, then sampling, then best responses."""

    kind: Literal["auto"] = "auto"
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Maximum number of agents whose joint actions are enumerated."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Maximum number of agents whose joint actions are sampled, if agents decide by their own value
    and assume best responses."""
    samples: Samples = 64
    """Sample size, see the evaluator ``sampling``."""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return self.chosen(problem).build(problem)

    def chosen(self, problem: DecisionProblem) -> EvaluatorSettings:
        """Return the settings of the chosen evaluator."""
        hierarchy = problem.hierarchy
        if problem.unseen == "plan" or problem.plan == "common":
            return EVALUATORS.parsed("best-response")
        free = max(1 + len(hierarchy.searched(i)) for i in range(len(hierarchy)))
        is_affordable = problem.budget is None or exact_joint_actions(problem) <= problem.budget
        is_small = free <= self.exact_up_to and problem.n_actions ** (free - 1) <= MAX_JOINT_ACTIONS
        if is_small and is_affordable:
            return EVALUATORS.parsed("exact")
        is_large = free > self.sampling_up_to or problem.value_of != "own"
        own_actions = problem.n_actions * len(problem.deciding)
        all_fit = problem.budget is None or own_actions <= problem.budget
        if is_large and all_fit and problem.teammates == "best-response":
            return EVALUATORS.parsed("best-response")
        return SamplingSettings(samples=self.samples)
