"""Interface of evaluators, and the base class of those that evaluate joint actions.

The mean value of several agents evaluates shared variables once. A rule base is a sum of terms; the
value of a term of common variables to all agents equals its value under the sum of their weights.
The same holds for the agents of one body and the variables of that body. The mean of many agents
therefore costs little more than the value of a few.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.agents import Counts
from ..interface.prediction import Exploring, Prediction, rewards_of, states_by_group, states_of
from ..numerics import FloatArray, IntArray
from ..plugins.registry import SettingsRegistry
from ..plugins.settings import PartSettings
from ..values.rule_base import PooledWeights, RuleBase
from .budget import check_budget, divide

Rule = Literal["value", "reward", "reward-and-value"]
"""Decision rule: the criterion by which joint actions are compared."""
Teammates = Literal["best-response", "uniform", "empirical", "conditional"]
"""Teammate model: the assumed behavior of the agents below."""
ValueOf = Literal["own", "below", "team"]
"""Averaged values: the agent's own, its own and those of the agents below, or all agents'."""
Unseen = Literal["maintain", "last", "plan"]
"""Assumed behavior of agents whose actions are neither received nor searched over."""
Plan = Literal["private", "common"]
"""Whether each agent makes its own plan, or all work out the same one."""
Predicted = Callable[[], FloatArray]
"""Predicts rewards or values of joint actions."""
NOTHING_GIVEN: FloatArray = np.zeros((0, 0, 0))
"""Empty conditional frequencies."""
NO_STATES: FloatArray = np.zeros((0, 0))
"""An empty array of states."""
NO_AGENTS: IntArray = np.zeros(0, dtype=np.int64)
"""An empty array of agents."""


class DecisionContext(NamedTuple):
    """Knowledge of an agent that decides."""

    agent: int
    """The deciding agent."""
    joint_action: IntArray
    """``(n,)`` actions that the agent was told, assumed actions of unseen agents, and neutral
    actions of the agents below."""
    prediction: Prediction
    """Predicts the outcome of joint actions."""
    weights: Sequence[FloatArray]
    """The consequent weights ``(n_rules,)`` of every agent, in agent order."""
    frequencies: FloatArray
    """``(n, A)`` observed action frequencies of every agent; rows sum to one."""
    rng: np.random.Generator
    """Source of randomness."""
    given: FloatArray = NOTHING_GIVEN
    """``(A, n, A)`` the same frequencies given each action of the deciding agent. Empty unless the
    teammate model is ``conditional``."""
    told: IntArray = NO_AGENTS
    """``(k,)`` agents that sent it their actions."""
    present: FloatArray = NO_STATES
    """``(n, d)`` present states of all agents. Learners of action values append the actions that
    each agent was told."""

    @property
    def own_weights(self) -> FloatArray:
        """The consequent weights of the deciding agent."""
        return self.weights[self.agent]


class Evaluator(ABC):
    """Values the actions of one agent."""

    continues: ClassVar[bool] = False
    """Whether it needs predictions of several decisions (`Prediction.after`)."""
    counts: Counts
    """Number of evaluations so far; the agents add their weight updates."""
    keeps_budget: ClassVar[bool] = False
    """Whether it keeps to the budget of its `DecisionProblem`."""
    expected: IntArray | None = None
    """``(n,)`` joint action that the last deciding agent expected; None without a plan."""

    @abstractmethod
    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""

    def decide(self, first: DecisionContext, exploring: Exploring) -> IntArray | None:
        """Return the joint action ``(n,)`` of agents that all hear each other.

        None if the evaluator has no joint search; then the agents decide one by one.

        Parameters
        ----------
        first
            Knowledge of the first agent.
        exploring
            State and probabilities of exploration.
        """
        return None


@dataclass(frozen=True)
class DecisionProblem:
    """Properties that all decisions of a team share."""

    rules: RuleBase
    """The agents' rule base."""
    hierarchy: Hierarchy
    """Communication and lookahead among the agents."""
    n_actions: int
    """Number A of actions of every agent."""
    groups: tuple[tuple[int, ...], ...]
    """Agents by body."""
    rule: Rule
    """Decision rule."""
    teammates: Teammates
    """Teammate model."""
    discount: float
    """Weight of the value if it is added to the reward."""
    value_of: ValueOf = "own"
    """Agents whose values are averaged."""
    unseen: Unseen = "maintain"
    """Assumed behavior of unseen agents."""
    plan: Plan = "private"
    """Whether plans are private or common."""
    handed_down: bool = True
    """Whether all messages arrive, so that plans may be handed down with them."""
    members: tuple[int, ...] | None = None
    """Agents that decide by the evaluator, in the order of decision; None: all agents."""
    is_private: bool = False
    """Whether agents have views of their own and share no intermediate results."""
    budget: int | None = None
    """Joint actions that the team may try in a decision; None: no limit."""

    @property
    def deciding(self) -> tuple[int, ...]:
        """The agents that decide by the evaluator, in the order of decision."""
        return self.hierarchy.order if self.members is None else self.members


class EvaluatorSettings(PartSettings):
    """Base class of settings of evaluators; `build` takes a `DecisionProblem`."""


EVALUATORS = SettingsRegistry(
    "evaluator",
    {
        "auto": f"{__package__}.enumeration:AutoSettings",
        "exact": f"{__package__}.enumeration:ExactSettings",
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
    """Return, for every agent, the agents whose values it averages, in agent order.

    >>> chain = Hierarchy("abc", [("a", "b"), ("b", "c")])
    >>> [[list(map(int, who)) for who in concerned(chain, of)] for of in ("own", "below")]
    [[[0], [1], [2]], [[0, 1, 2], [1, 2], [2]]]
    """
    every = range(len(hierarchy))
    if value_of == "team":
        return [np.arange(len(hierarchy))] * len(hierarchy)
    below = [hierarchy.searched(i) if value_of == "below" else () for i in every]
    return [np.array(sorted((i, *below[i]))) for i in every]


class Aggregation(Evaluator):
    """Base class of evaluators: the decision rule and the aggregation over teammates.

    Raises
    ------
    ValueError
        If the settings ask for a plan and the evaluator makes none.
    """

    keeps_budget = True
    name: str = ""
    """Name in a spec."""
    plans: ClassVar[bool] = False
    """Whether the evaluator makes plans for the other agents."""

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
        """By agent, ``(k,)`` the agents whose values it averages."""
        self._body_of = np.array([g for g, group in enumerate(problem.groups) for _ in group])
        self._weights: Sequence[FloatArray] = ()
        self._pooled: PooledWeights | None = None
        self._have_learned: set[int] = set()
        self._is_prepared = False

    @staticmethod
    def require(key: str, value: str, allowed: str, why: str) -> None:
        """Refuse a decision setting: the evaluator allows only one value of this key."""
        if value != allowed:
            raise ValueError(f"learner.decision.{key} = {value!r}: {why}")

    def begins(self, context: DecisionContext) -> bool:
        """Return whether this agent is the first in a decision of the team.

        With views of their own, all agents are.
        """
        before, self._prediction = self._prediction, context.prediction
        first = self.problem.deciding[0]
        is_first = context.agent == first or before is not context.prediction
        return is_first or self.problem.is_private

    def shares(self, needs: Sequence[int], least: int) -> list[int]:
        """Return the number of joint actions that each agent may try in a decision.

        Parameters
        ----------
        needs
            By agent, the joint actions that it tries without a budget.
        least
            Joint actions that every agent tries at least.

        Raises
        ------
        ValueError
            If the budget is below the least that all agents try together.
        """
        budget, deciding = self.problem.budget, self.problem.deciding
        if budget is None:
            return list(needs)
        self.check_budget(least * len(deciding))
        shares = list(needs)
        for agent, share in zip(
            deciding, divide(budget, [needs[i] for i in deciding]), strict=True
        ):
            shares[agent] = share
        return shares

    def check_budget(self, least: int) -> None:
        """Refuse a budget below the `least` number of joint actions that the team tries."""
        check_budget(self.problem.budget, least, self.name)

    def count(self, agent: int, joint_actions: int) -> None:
        """Count evaluated joint actions, and the rules that each averaged agent evaluated."""
        valued = 0 if self.problem.rule == "reward" else len(self.concerned[agent])
        self.counts.joint_actions += joint_actions
        self.counts.rule_evaluations += joint_actions * valued * self.rules.n_rules

    def all_values_zero(self, context: DecisionContext) -> bool:
        """Return whether all weights are zero, as before learning."""
        agent = context.agent
        if self.problem.rule != "value" or agent in self._have_learned:
            return False
        if any(context.weights[i].any() for i in self.concerned[agent].tolist()):
            self._have_learned.add(agent)
        is_zero = agent not in self._have_learned
        if is_zero and not self._is_prepared:
            self._is_prepared = True
            self.prepare_kernels(context)
        return is_zero

    def prepare_kernels(self, context: DecisionContext) -> None:
        """Begin to compile what later decisions call, while all values are zero."""
        self.rules.prepare_kernels()
        context.prediction.prepare_kernels()

    def pooled(self, context: DecisionContext) -> PooledWeights:
        """Return the summed weights of the averaged agents, the same object within a decision."""
        agents = self.concerned[context.agent]
        last = self._pooled
        if last is None or last.agents is not agents or self._weights is not context.weights:
            theta = np.array([context.weights[i] for i in agents], dtype=float)
            bodies, firsts = np.unique(self._body_of[agents], return_index=True)
            summed = np.add.reduceat(theta, firsts, axis=0), theta.sum(axis=0)[None]
            last = PooledWeights((theta, *summed), agents, bodies, np.append(firsts, len(agents)))
            self._pooled = last
            self._weights = context.weights
        return last

    def worth(self, context: DecisionContext, joint_actions: IntArray) -> FloatArray:
        """Return the values ``(m,)`` of joint actions ``(m, n)`` to the agent, and count them."""
        self.count(context.agent, len(joint_actions))
        return self.predicted_worth(context, joint_actions)

    def predicted_worth(self, context: DecisionContext, joint_actions: IntArray) -> FloatArray:
        """Return the same values without counting."""
        prediction = context.prediction
        concerned = self.concerned[context.agent]

        def values() -> FloatArray:
            if len(concerned) > 1:
                return self.mean(self.pooled(context), prediction, joint_actions)
            states = states_of(prediction, context.agent, joint_actions)
            return self.rules.values(context.own_weights, states)

        return self.combine(lambda: rewards_of(prediction, joint_actions), values)

    def mean(self, pooled: PooledWeights, prediction: Prediction, joint: IntArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents after joint actions ``(m, n)``."""
        own, shared = states_by_group(prediction, joint, self.problem.groups, self.rules.n_own)
        if len(pooled.bodies) < len(shared):
            shared = shared[pooled.bodies]
        return self.rules.summed_values(pooled, own, shared) / len(pooled.agents)

    def worths(self, context: DecisionContext, tried: IntArray) -> FloatArray:
        """Return values ``(A, m)`` of own actions, each with joint actions `tried` ``(m, k)``."""
        joint = self.joint_actions(context, np.arange(self.n_actions), tried)
        return self.worth(context, joint).reshape(self.n_actions, -1)

    def joint_actions(self, context: DecisionContext, own: IntArray, tried: IntArray) -> IntArray:
        """Return each own action ``(b,)`` with each of the actions `tried` ``(m, k)`` below.

        The joint actions are ``(b m, n)``.
        """
        agent, n = context.agent, len(context.joint_action)
        joint = np.empty((len(own), len(tried), n), dtype=np.int64)
        joint[:] = context.joint_action
        joint[:, :, agent] = own[:, None]
        joint[:, :, list(self.hierarchy.searched(agent))] = tried
        return joint.reshape(-1, n)

    def sample(self, probabilities: FloatArray, samples: int, rng: np.random.Generator) -> IntArray:
        """Sample actions ``(samples, ...)`` by their probabilities ``(..., A)``."""
        ladder = probabilities.cumsum(axis=-1)[..., :-1]
        return (rng.random((samples, *ladder.shape[:-1], 1)) >= ladder).sum(axis=-1)

    def combine(self, rewards: Predicted, values: Predicted) -> FloatArray:
        """Combine rewards and values by the decision rule; predict only those that it needs."""
        if self.problem.rule == "value":
            return values()
        if self.problem.rule == "reward":
            return rewards()
        return rewards() + self.problem.discount * values()

    def aggregate(
        self, context: DecisionContext, tried: IntArray, probabilities: FloatArray | None
    ) -> FloatArray:
        """Return the maximum, mean or weighted mean ``(A,)`` of values, by the teammate model.

        Parameters
        ----------
        context
            Knowledge of the deciding agent.
        tried
            ``(m, k)`` joint actions of the agents below.
        probabilities
            ``(m,)`` probabilities of these joint actions, or ``(A, m)`` given each own action;
            None: all equal.
        """
        if self.all_values_zero(context):
            self.count(context.agent, self.n_actions * len(tried))
            return np.zeros(self.n_actions)
        values = self.worths(context, tried)
        if self.problem.teammates == "best-response":
            return values.max(axis=1)
        if probabilities is not None and probabilities.ndim == 2:
            return (values * probabilities).sum(axis=1)
        return values.mean(axis=1) if probabilities is None else values @ probabilities
