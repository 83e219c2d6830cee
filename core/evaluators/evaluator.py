"""What an evaluator is and what it is asked, and what those share that try joint actions.

In the mean value of several agents each thing that they share is valued once. A rule base is a sum
of terms. What a term of common variables is worth to all agents is what it is worth to one that has
the sum of their consequent weights; likewise for the agents of one body and the variables that they
share. So the mean of many agents costs little more than the value of a few.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np

from ..interface.hierarchy import Hierarchy
from ..interface.prediction import Prediction, states_by_group
from ..numerics import FloatArray, IntArray
from ..plugins.settings import PartSettings
from ..rules.rule_base import RuleBase


class Pooled(NamedTuple):
    """The consequent weights of k agents of b bodies, summed where they see the same."""

    weights: tuple[FloatArray, FloatArray, FloatArray]
    """Of the agents ``(k, n_rules)``, of their bodies ``(b, n_rules)``, of all ``(1, n_rules)``."""
    agents: IntArray
    """``(k,)`` which agents they are."""
    bodies: IntArray
    """``(b,)`` which bodies they are."""
    firsts: IntArray
    """``(b + 1,)`` the first agent of every body among them, and k."""


class Pooling:
    """Means of the values of agents.

    Parameters
    ----------
    rules
        The agents' rule base.
    groups
        Agents by body: their shared variables are the same.
    """

    def __init__(self, rules: RuleBase, groups: tuple[tuple[int, ...], ...]) -> None:
        self._rules, self._groups = rules, groups
        self._body_of = np.array([g for g, group in enumerate(groups) for _ in group])
        sharing = [rules.shared_by(term) for term in rules.terms]
        own, body, common = (
            np.array([t for t, by in enumerate(sharing) if by == kind], dtype=np.int64)
            for kind in ("agent", "body", "all")
        )
        self._kinds = own, body, common

    def pooled(self, weights: Sequence[FloatArray], agents: IntArray) -> Pooled:
        """Return the weights of some agents in agent order; `weights` are those of all agents."""
        theta = np.array([weights[i] for i in agents], dtype=float)
        bodies, firsts = np.unique(self._body_of[agents], return_index=True)
        summed = np.add.reduceat(theta, firsts, axis=0), theta.sum(axis=0)[None]
        return Pooled((theta, *summed), agents, bodies, np.append(firsts, len(agents)))

    def mean(self, pooled: Pooled, prediction: Prediction, joint_actions: IntArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents after joint actions ``(m, n)``."""
        own, shared = states_by_group(prediction, joint_actions, self._groups, self._rules.n_own)
        if len(pooled.bodies) < len(shared):
            shared = shared[pooled.bodies]
        total = self._rules.total(
            pooled.weights, pooled.agents, pooled.firsts, self._kinds, own, shared
        )
        return total / len(pooled.agents)


Rule = Literal["value", "reward", "reward-and-value"]
"""By what a joint action is valued."""
Teammates = Literal["best-response", "uniform", "empirical", "conditional"]
"""The teammate model: what the agents below are expected to do."""

ValueOf = Literal["own", "below", "team"]
"""Whose value decides: the agent's own, the mean of its own and those below it, or all agents'."""
Unseen = Literal["maintain", "last", "plan"]
"""What agents are expected to do of whom nothing is heard and who are not considered."""
Plan = Literal["private", "common"]
"""Whether each agent makes its own plan, or all work out the same one."""


MOST_JOINT_ACTIONS = 4**11
"""The most of some agents that are tried with each action of another: more fill the memory."""
Predicted = Callable[[], FloatArray]
"""Predicts something of joint actions."""
NOTHING_GIVEN: FloatArray = np.zeros((0, 0, 0))
"""Conditional frequencies that nobody counts."""
NO_STATES: FloatArray = np.zeros((0, 0))
"""States that nobody looks at."""
NOBODY: IntArray = np.zeros(0, dtype=np.int64)
"""No agents."""


class Deliberation(NamedTuple):
    """What an agent knows when it decides."""

    agent: int
    """The deciding agent."""
    joint_action: IntArray
    """``(n,)`` the actions of which it was told; of the unseen what they are taken to do; neutral
    for those below."""
    prediction: Prediction
    """Predicts what joint actions would lead to."""
    weights: Sequence[FloatArray]
    """The consequent weights ``(n_rules,)`` of every agent, in agent order."""
    frequencies: FloatArray
    """``(n, A)`` how often each agent was seen to take each action, rows summing to one."""
    rng: np.random.Generator
    """Source of randomness."""
    given: FloatArray = NOTHING_GIVEN
    """``(A, n, A)`` the same frequencies, given each action of the deciding agent; counted where
    the teammate model asks for it, else empty."""
    told: IntArray = NOBODY
    """``(k,)`` the agents of whose actions it was told."""
    present: FloatArray = NO_STATES
    """``(n, d)`` the states that all agents are in; where the learner values actions, with the
    actions that they are told."""

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


@dataclass(frozen=True)
class DecisionProblem:
    """What all decisions of a team have in common."""

    rules: RuleBase
    """The agents' rule base."""
    hierarchy: Hierarchy
    """Who considers whom, and who is told by whom."""
    n_actions: int
    """Actions A of every agent."""
    groups: tuple[tuple[int, ...], ...]
    """Agents by body."""
    rule: Rule
    """By what a joint action is valued."""
    teammates: Teammates
    """What the agents below are expected to do."""
    discount: float
    """Weight of the value, where it is added to the reward."""
    value_of: ValueOf = "own"
    """Whose value decides."""
    unseen: Unseen = "maintain"
    """What the unseen are expected to do."""
    plan: Plan = "private"
    """Who makes a plan."""
    handed_down: bool = True
    """Whether all that is told arrives, so that a plan may be told, too."""


class EvaluatorSettings(PartSettings):
    """What the settings of all evaluators inherit; `build` is given a `DecisionProblem`."""


def combinations(agents: tuple[int, ...], n_actions: int) -> IntArray:
    """Return all joint actions ``(A ** k, k)`` of k agents, in lexicographic order.

    Raises
    ------
    ValueError
        If they are too many; before anything is allocated.
    """
    if n_actions ** len(agents) > MOST_JOINT_ACTIONS:
        raise ValueError(
            f"learner.decision.evaluator: {n_actions} ** {len(agents)} joint actions of "
            f"{len(agents)} agents would be tried, allowed {MOST_JOINT_ACTIONS}; use sampling"
        )
    if not agents:
        return np.zeros((1, 0), dtype=np.int64)
    grid = np.indices((n_actions,) * len(agents)).reshape(len(agents), -1)
    return np.ascontiguousarray(grid.T, dtype=np.int64)


def concerned(hierarchy: Hierarchy, value_of: ValueOf) -> list[IntArray]:
    """Return, for every agent, the agents whose values decide what it does, in agent order.

    >>> chain = Hierarchy("abc", [("a", "b"), ("b", "c")])
    >>> [[list(map(int, who)) for who in concerned(chain, of)] for of in ("own", "below")]
    [[[0], [1], [2]], [[0, 1, 2], [1, 2], [2]]]
    """
    every = range(len(hierarchy))
    if value_of == "team":
        return [np.arange(len(hierarchy))] * len(hierarchy)
    below = [hierarchy.below(i) if value_of == "below" else () for i in every]
    return [np.array(sorted((i, *below[i]))) for i in every]


class Aggregation:
    """What evaluators share: the decision rule, and the aggregation over teammates.

    Raises
    ------
    ValueError
        If there is to be a plan, and the evaluator makes none.
    """

    plans: ClassVar[bool] = False
    """Whether it makes plans for the other agents."""

    def __init__(self, problem: DecisionProblem) -> None:
        for key, value, of_plans in (
            ("unseen", problem.unseen, "plan"),
            ("plan", problem.plan, "common"),
        ):
            if value == of_plans and not self.plans:
                raise ValueError(
                    f"learner.decision.{key} = {value!r}: needs an evaluator that makes plans, use "
                    "best-response"
                )
        self.problem = problem
        self.rules, self.hierarchy = problem.rules, problem.hierarchy
        self.n_actions = problem.n_actions
        self.counts = Counts()
        self.concerned = concerned(self.hierarchy, problem.value_of)
        """Per agent ``(k,)`` the agents whose values decide."""
        self._pooling = Pooling(problem.rules, problem.groups)
        self._last: tuple[Sequence[FloatArray], IntArray, Pooled] | None = None

    def require(self, key: str, allowed: str, why: str) -> None:
        """Refuse decision settings whose `key` is not what is allowed here."""
        value = getattr(self.problem, key)
        if value != allowed:
            raise ValueError(f"learner.decision.{key} = {value!r}: {why}")

    def count(self, agent: int, joint_actions: int) -> None:
        """Note that joint actions have been tried: valued by each agent concerned, or rewarded."""
        valued = 0 if self.problem.rule == "reward" else len(self.concerned[agent])
        self.counts.joint_actions += joint_actions
        self.counts.rule_evaluations += joint_actions * valued * self.rules.n_rules

    def indifferent(self, deliberation: Deliberation) -> bool:
        """Return whether every action must come to zero: nothing is learned yet, or ever."""
        if self.problem.rule != "value":
            return False
        if len(self.concerned[deliberation.agent]) > 1:
            return not self._pooled(deliberation).weights[0].any()
        weights = deliberation.own_weights
        return not (weights[:64].any() or weights.any())

    def worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return what joint actions ``(m, n)`` are worth to the deciding agent, ``(m,)``."""
        self.count(deliberation.agent, len(joint_actions))
        return self.predicted_worth(deliberation, joint_actions)

    def predicted_worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return the same of joint actions that are counted elsewhere."""
        prediction: Any = deliberation.prediction
        concerned = self.concerned[deliberation.agent]

        def values() -> FloatArray:
            if len(concerned) > 1:
                return self._pooling.mean(self._pooled(deliberation), prediction, joint_actions)
            states = prediction.states(deliberation.agent, joint_actions)
            return self.rules.values(deliberation.own_weights, states)

        return self.combine(lambda: prediction.rewards(joint_actions), values)

    def _pooled(self, deliberation: Deliberation) -> Pooled:
        """Return the pooled weights of those concerned, once for agents of one decision."""
        weights, concerned = deliberation.weights, self.concerned[deliberation.agent]
        if self._last is None or self._last[0] is not weights or self._last[1] is not concerned:
            self._last = weights, concerned, self._pooling.pooled(weights, concerned)
        return self._last[2]

    def worths(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value ``(A, m)`` each own action with each of the joint actions `tried` ``(m, k)``."""
        agent, a = deliberation.agent, self.n_actions
        joint = np.tile(deliberation.joint_action, (a * len(tried), 1))
        joint[:, agent] = np.repeat(np.arange(a), len(tried))
        joint[:, list(self.hierarchy.below(agent))] = np.tile(tried, (a, 1))
        return self.worth(deliberation, joint).reshape(a, -1)

    def combine(self, rewards: Predicted, values: Predicted) -> FloatArray:
        """Return what the decision rule makes of rewards and values; it predicts what it needs."""
        if self.problem.rule == "value":
            return values()
        if self.problem.rule == "reward":
            return rewards()
        return rewards() + self.problem.discount * values()

    def aggregate(
        self, deliberation: Deliberation, tried: IntArray, probabilities: FloatArray | None
    ) -> FloatArray:
        """Return the maximum, mean or weighted mean ``(A,)`` of worths, by the teammate model.

        Parameters
        ----------
        deliberation
            Whose.
        tried
            ``(m, k)`` joint actions of the agents below.
        probabilities
            Of these ``(m,)``, or ``(A, m)`` where they depend on the own action; none: equal ones.
        """
        if self.indifferent(deliberation):
            self.count(deliberation.agent, self.n_actions * len(tried))
            return np.zeros(self.n_actions)
        values = self.worths(deliberation, tried)
        if self.problem.teammates == "best-response":
            return values.max(axis=1)
        if probabilities is not None and probabilities.ndim == 2:
            return (values * probabilities).sum(axis=1)
        return values.mean(axis=1) if probabilities is None else values @ probabilities
