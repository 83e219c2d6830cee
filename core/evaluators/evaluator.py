"""Evaluators: their interface, and what those that value joint actions have in common.

In the mean value of several agents each thing that they share is valued once. A rule base is a sum
of terms. What a term of common variables is worth to all agents is what it is worth to one that has
the sum of their consequent weights; likewise for the agents of one body and the variables that they
share. So the mean of many agents costs little more than the value of a few.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import Counts
from ..interface.prediction import Exploring, Prediction, rewards_of, states_by_group
from ..numerics import FloatArray, IntArray
from ..plugins.registry import SettingsRegistry
from ..plugins.settings import PartSettings
from ..values.rule_base import PooledWeights, RuleBase

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


class Evaluator(ABC):
    """Values the actions of one agent."""

    continues: ClassVar[bool] = False
    """Whether it needs a prediction that goes on from where it leads, see `Prediction.after`."""
    counts: Counts
    """What has been evaluated so far; the agents add what they learn."""
    expected: IntArray | None = None
    """``(n,)`` the joint action that the last agent to decide expected; none: it had no plan."""

    @abstractmethod
    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""

    def decide(self, first: Deliberation, exploring: Exploring) -> IntArray | None:
        """Return what all agents decide ``(n,)``, who all hear all; None: ask one by one.

        Parameters
        ----------
        first
            What the first agent knows.
        exploring
            How agents explore, by actions that are held.
        """
        return None


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
    first: int | None = None
    """Who of those agents decides first; none: the first of the hierarchy."""
    is_private: bool = False
    """Whether agents have views of their own, so that nothing worked out for one is another's."""


class EvaluatorSettings(PartSettings):
    """What the settings of all evaluators inherit; `build` is given a `DecisionProblem`."""


EVALUATORS = SettingsRegistry(
    "evaluator",
    {
        "auto": f"{__package__}.enumeration:AutoSettings",
        "exact": f"{__package__}.enumeration:ExactEnumeration",
        "sampling": f"{__package__}.enumeration:SamplingSettings",
        "variable-elimination": f"{__package__}.coordination:VariableEliminationSettings",
        "max-plus": f"{__package__}.coordination:MaxPlusSettings",
        "best-response": f"{__package__}.best_response:BestResponseSettings",
        "cross-entropy": f"{__package__}.coordination:CrossEntropySettings",
    },
    EvaluatorSettings,
)
"""Evaluators by name."""


def concerned(hierarchy: Hierarchy, value_of: ValueOf) -> list[IntArray]:
    """Return, for every agent, the agents whose values decide what it does, in agent order.

    >>> chain = Hierarchy("abc", [("a", "b"), ("b", "c")])
    >>> [[list(map(int, who)) for who in concerned(chain, of)] for of in ("own", "below")]
    [[[0], [1], [2]], [[0, 1, 2], [1, 2], [2]]]
    """
    every = range(len(hierarchy))
    if value_of == "team":
        return [np.arange(len(hierarchy))] * len(hierarchy)
    below = [hierarchy.searched(i) if value_of == "below" else () for i in every]
    return [np.array(sorted((i, *below[i]))) for i in every]


class Learned:
    """What some agents have learned when they decide; each of its parts is worked out once.

    Parameters
    ----------
    weights
        The consequent weights ``(n_rules,)`` of every agent, in agent order.
    agents
        ``(k,)`` the agents that it is about, in agent order.
    body_of
        ``(n,)`` the body of every agent.
    """

    def __init__(self, weights: Sequence[FloatArray], agents: IntArray, body_of: IntArray) -> None:
        self.weights = weights
        self.agents = agents
        self._body_of = body_of

    @cached_property
    def is_nothing(self) -> bool:
        """Whether all their weights are zero."""
        each = (self.weights[i] for i in self.agents.tolist())
        return not any(own[:64].any() or own.any() for own in each)

    @cached_property
    def pooled(self) -> PooledWeights:
        """Their weights, summed where they see the same."""
        theta = np.array([self.weights[i] for i in self.agents], dtype=float)
        bodies, firsts = np.unique(self._body_of[self.agents], return_index=True)
        summed = np.add.reduceat(theta, firsts, axis=0), theta.sum(axis=0)[None]
        return PooledWeights(
            (theta, *summed), self.agents, bodies, np.append(firsts, len(self.agents))
        )


class Aggregation(Evaluator):
    """What evaluators share: the decision rule, and the aggregation over teammates.

    Raises
    ------
    ValueError
        If there is to be a plan, and the evaluator makes none.
    """

    plans: ClassVar[bool] = False
    """Whether it makes plans for the other agents."""

    def __init__(self, problem: DecisionProblem) -> None:
        wants_plans = {"unseen": problem.unseen == "plan", "plan": problem.plan == "common"}
        for key in (key for key, wanted in wants_plans.items() if wanted and not self.plans):
            value = "plan" if key == "unseen" else "common"
            raise ValueError(
                f"learner.decision.{key} = {value!r}: needs an evaluator that makes plans, use "
                "best-response"
            )
        self.problem = problem
        self.rules = problem.rules
        self.hierarchy = problem.hierarchy
        self.n_actions = problem.n_actions
        self.counts = Counts()
        self._prediction: Prediction | None = None
        self.concerned = concerned(self.hierarchy, problem.value_of)
        """Per agent ``(k,)`` the agents whose values decide."""
        self._body_of = np.array([g for g, group in enumerate(problem.groups) for _ in group])
        self._learned: Learned | None = None
        self._have_learned: set[int] = set()

    @staticmethod
    def require(key: str, value: str, allowed: str, why: str) -> None:
        """Refuse decision settings whose `key` has another `value` than is allowed here."""
        if value != allowed:
            raise ValueError(f"learner.decision.{key} = {value!r}: {why}")

    def begins(self, deliberation: Deliberation) -> bool:
        """Return whether a decision of the team begins with this one's; it is asked of each.

        Of agents with views of their own each begins anew.
        """
        before, self._prediction = self._prediction, deliberation.prediction
        first = self.hierarchy.order[0] if self.problem.first is None else self.problem.first
        is_first = deliberation.agent == first or before is not deliberation.prediction
        return is_first or self.problem.is_private

    def count(self, agent: int, joint_actions: int) -> None:
        """Note that joint actions have been tried: valued by each agent concerned, or rewarded."""
        valued = 0 if self.problem.rule == "reward" else len(self.concerned[agent])
        self.counts.joint_actions += joint_actions
        self.counts.rule_evaluations += joint_actions * valued * self.rules.n_rules

    def indifferent(self, deliberation: Deliberation) -> bool:
        """Return whether every action must come to zero: nothing is learned yet, or ever."""
        agent = deliberation.agent
        if self.problem.rule != "value" or agent in self._have_learned:
            return False
        if self.learned(deliberation).is_nothing:
            return True
        self._have_learned.add(agent)
        return False

    def learned(self, deliberation: Deliberation) -> Learned:
        """Return what those concerned have learned: one and the same for agents of one decision."""
        weights, concerned = deliberation.weights, self.concerned[deliberation.agent]
        last = self._learned
        if last is None or last.weights is not weights or last.agents is not concerned:
            last = self._learned = Learned(weights, concerned, self._body_of)
        return last

    def worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return what joint actions ``(m, n)`` are worth to the deciding agent, ``(m,)``."""
        self.count(deliberation.agent, len(joint_actions))
        return self.predicted_worth(deliberation, joint_actions)

    def predicted_worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return the same of joint actions, which the caller counts."""
        prediction = deliberation.prediction
        concerned = self.concerned[deliberation.agent]

        def values() -> FloatArray:
            if len(concerned) > 1:
                return self.mean(self.learned(deliberation).pooled, prediction, joint_actions)
            states = prediction.states(deliberation.agent, joint_actions)
            return self.rules.values(deliberation.own_weights, states)

        return self.combine(lambda: rewards_of(prediction, joint_actions), values)

    def mean(self, pooled: PooledWeights, prediction: Prediction, joint: IntArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents after joint actions ``(m, n)``."""
        own, shared = states_by_group(prediction, joint, self.problem.groups, self.rules.n_own)
        if len(pooled.bodies) < len(shared):
            shared = shared[pooled.bodies]
        return self.rules.summed_values(pooled, own, shared) / len(pooled.agents)

    def worths(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value ``(A, m)`` each own action with each of the joint actions `tried` ``(m, k)``."""
        agent, a = deliberation.agent, self.n_actions
        n = len(deliberation.joint_action)
        joint = np.empty((a, len(tried), n), dtype=np.int64)
        joint[:] = deliberation.joint_action
        joint[:, :, agent] = np.arange(a)[:, None]
        joint[:, :, list(self.hierarchy.searched(agent))] = tried
        return self.worth(deliberation, joint.reshape(-1, n)).reshape(a, -1)

    def drawn(self, probabilities: FloatArray, samples: int, rng: np.random.Generator) -> IntArray:
        """Return actions ``(samples, ...)`` drawn by their probabilities ``(..., A)``."""
        ladder = probabilities.cumsum(axis=-1)[..., :-1]
        return (rng.random((samples, *ladder.shape[:-1], 1)) >= ladder).sum(axis=-1)

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
