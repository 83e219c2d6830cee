"""Evaluators: their interface, and what those that try joint actions have in common.

In the mean value of several agents each thing that they share is valued once. A rule base is a sum
of terms. What a term of common variables is worth to all agents is what it is worth to one that has
the sum of their consequent weights; likewise for the agents of one body and the variables that they
share. So the mean of many agents costs little more than the value of a few.

Here are also those that try every joint action of the agents below, or a random sample. Few agents
are enumerated, some sampled, and many planned for. Of many agents best responses around a plan
reach greater values than a sample, in half of its time. They are also taken for some, if the values
of others decide too, and wherever there must be a plan.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from pydantic import Field

from ..interface.hierarchy import Hierarchy
from ..interface.spaces import Prediction, has_tables, states_by_group
from ..numerics import FloatArray, IntArray
from ..plugins.registry import SettingsRegistry
from ..plugins.settings import PartSettings
from ..rules.kernels.dense import Tried
from ..rules.rule_base import Pooled, RuleBase

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


EVALUATORS = SettingsRegistry(
    "evaluator",
    {
        "auto": f"{__name__}:AutoSettings",
        "exact": f"{__name__}:ExactEnumeration",
        "sampling": f"{__name__}:SamplingSettings",
        "variable-elimination": f"{__package__}.coordination:VariableEliminationSettings",
        "max-plus": f"{__package__}.coordination:MaxPlusSettings",
        "best-response": f"{__package__}.best_response:BestResponseSettings",
        "cross-entropy": f"{__package__}.coordination:CrossEntropySettings",
    },
    EvaluatorSettings,
)
"""Evaluators by name."""


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
    k = len(agents)
    grid = np.indices((n_actions,) * k).reshape(k, n_actions**k)
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
        for key, of_plans in (("unseen", "plan"), ("plan", "common")):
            if (value := getattr(problem, key)) == of_plans and not self.plans:
                raise ValueError(
                    f"learner.decision.{key} = {value!r}: needs an evaluator that makes plans, use "
                    "best-response"
                )
        self.problem = problem
        self.rules, self.hierarchy = problem.rules, problem.hierarchy
        self.n_actions = problem.n_actions
        self.counts = Counts()
        self._prediction: Prediction | None = None
        self.concerned = concerned(self.hierarchy, problem.value_of)
        """Per agent ``(k,)`` the agents whose values decide."""
        self._body_of = np.array([g for g, group in enumerate(problem.groups) for _ in group])
        self._last: tuple[Sequence[FloatArray], IntArray, Pooled] | None = None

    def require(self, key: str, allowed: str, why: str) -> None:
        """Refuse decision settings whose `key` is not what is allowed here."""
        value = getattr(self.problem, key)
        if value != allowed:
            raise ValueError(f"learner.decision.{key} = {value!r}: {why}")

    def begins(self, deliberation: Deliberation) -> bool:
        """Return whether a decision of the team begins with this one's; it is asked of each."""
        before, self._prediction = self._prediction, deliberation.prediction
        first = deliberation.agent == self.hierarchy.order[0]
        return first or before is not deliberation.prediction

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
            weights = self._pooled(deliberation).weights[0].ravel()
        else:
            weights = deliberation.own_weights
        return not (weights[:64].any() or weights.any())

    def worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return what joint actions ``(m, n)`` are worth to the deciding agent, ``(m,)``."""
        self.count(deliberation.agent, len(joint_actions))
        return self.predicted_worth(deliberation, joint_actions)

    def predicted_worth(self, deliberation: Deliberation, joint_actions: IntArray) -> FloatArray:
        """Return the same of joint actions, which the caller counts."""
        prediction: Any = deliberation.prediction
        concerned = self.concerned[deliberation.agent]

        def values() -> FloatArray:
            if len(concerned) > 1:
                return self.mean(self._pooled(deliberation), prediction, joint_actions)
            states = prediction.states(deliberation.agent, joint_actions)
            return self.rules.values(deliberation.own_weights, states)

        return self.combine(lambda: prediction.rewards(joint_actions), values)

    def _pooled(self, deliberation: Deliberation) -> Pooled:
        """Return the pooled weights of those concerned, once for agents of one decision."""
        weights, concerned = deliberation.weights, self.concerned[deliberation.agent]
        if self._last is None or self._last[0] is not weights or self._last[1] is not concerned:
            self._last = weights, concerned, self.pooled(weights, concerned)
        return self._last[2]

    def pooled(self, weights: Sequence[FloatArray], agents: IntArray) -> Pooled:
        """Return the weights of some agents in agent order; `weights` are those of all agents."""
        theta = np.array([weights[i] for i in agents], dtype=float)
        bodies, firsts = np.unique(self._body_of[agents], return_index=True)
        summed = np.add.reduceat(theta, firsts, axis=0), theta.sum(axis=0)[None]
        return Pooled((theta, *summed), agents, bodies, np.append(firsts, len(agents)))

    def mean(self, pooled: Pooled, prediction: Prediction, joint: IntArray) -> FloatArray:
        """Return the mean value ``(m,)`` of the pooled agents after joint actions ``(m, n)``."""
        own, shared = states_by_group(prediction, joint, self.problem.groups, self.rules.n_own)
        if len(pooled.bodies) < len(shared):
            shared = shared[pooled.bodies]
        return self.rules.total(pooled, own, shared) / len(pooled.agents)

    def worths(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value ``(A, m)`` each own action with each of the joint actions `tried` ``(m, k)``."""
        agent, a = deliberation.agent, self.n_actions
        joint = np.tile(deliberation.joint_action, (a * len(tried), 1))
        joint[:, agent] = np.repeat(np.arange(a), len(tried))
        joint[:, list(self.hierarchy.below(agent))] = np.tile(tried, (a, 1))
        return self.worth(deliberation, joint).reshape(a, -1)

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


Samples = Annotated[int, Field(ge=1, le=1_000_000)]


def probabilities_of(frequencies: FloatArray, below: tuple[int, ...]) -> FloatArray:
    """Return the probability ``(A ** k,)`` of each joint action of the k agents below."""
    probabilities = np.ones(1)
    for agent in below:
        probabilities = np.multiply.outer(probabilities, frequencies[agent]).ravel()
    return probabilities / probabilities.sum()


class ExactEnumeration(Aggregation):
    """Tries every joint action of the agents below, as the paper: ``A ** (1 + len(below))`` each.

    If all agents together try at least as many joint actions as there are, and the prediction has
    tables of all, next states are taken from there; else they are predicted for the joint actions
    that are tried.

    Raises
    ------
    ValueError
        If an agent would have to try more than `MOST_JOINT_ACTIONS`.
    """

    def __init__(self, problem: DecisionProblem) -> None:
        super().__init__(problem)
        n, a = len(self.hierarchy), self.n_actions
        self._below = [combinations(self.hierarchy.below(i), a) for i in range(n)]
        uniform = problem.teammates == "uniform"
        self._expected = np.full((n, a), 1.0 / a) if uniform else np.zeros((0, 0))
        self._tried: list[Tried] = []
        self._means: tuple[tuple[object, ...], FloatArray] | None = None
        if self.hierarchy.joint_actions(a) >= a**n:
            places = a ** np.arange(n - 1, -1, -1, dtype=np.int64)
            self._tried = [self._tried_by(i, places) for i in range(n)]

    def _tried_by(self, agent: int, places: IntArray) -> Tried:
        below = np.array(self.hierarchy.below(agent), dtype=np.int64)
        own = np.arange(self.n_actions)[:, None] * places[agent]
        given = places.copy()
        given[agent] = given[below] = 0
        return own + self._below[agent] @ places[below], given, below

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent, problem = deliberation.agent, self.problem
        prediction: Any = deliberation.prediction
        conditional = problem.teammates == "conditional"
        own_value = problem.rule == "value" and len(self.concerned[agent]) == 1
        if own_value and not conditional and self._tried and hasattr(prediction, "blocks"):
            tried, blocks = self._tried[agent], prediction.blocks(agent)
            self.count(agent, tried[0].size)
            empirical = problem.teammates == "empirical"
            expected = deliberation.frequencies if empirical else self._expected
            weights, joint = deliberation.own_weights, deliberation.joint_action
            return self.rules.enumerate(weights, blocks, tried, joint, expected)
        below, probabilities = self.hierarchy.below(agent), None
        if problem.teammates == "empirical":
            probabilities = probabilities_of(deliberation.frequencies, below)
        elif conditional:
            probabilities = np.stack([probabilities_of(rows, below) for rows in deliberation.given])
        return self.aggregate(deliberation, self._below[agent], probabilities)

    def worths(self, deliberation: Deliberation, tried: IntArray) -> FloatArray:
        """Value each own action with each of the joint actions below, from tables if there are."""
        prediction: Any = deliberation.prediction
        if not (self._tried and has_tables(prediction)):
            return super().worths(deliberation, tried)
        known, places, _ = self._tried[deliberation.agent]
        indices = (known + int(deliberation.joint_action @ places)).ravel()
        self.count(deliberation.agent, len(indices))
        worth = self.combine(
            lambda: prediction.reward_table()[indices], lambda: self._mean(deliberation)[indices]
        )
        return worth.reshape(self.n_actions, -1)

    def _mean(self, deliberation: Deliberation) -> FloatArray:
        """Return the mean value ``(A ** n,)`` of all joint actions, once for a whole decision."""
        prediction: Any = deliberation.prediction
        weights, concerned = deliberation.weights, self.concerned[deliberation.agent]
        of = prediction, weights, concerned
        if self._means is None or any(a is not b for a, b in zip(self._means[0], of, strict=True)):
            indices, value = np.arange(self.n_actions ** len(weights)), self.rules.block_values
            each = [value(weights[i], prediction.blocks(i), indices) for i in concerned]
            self._means = of, np.mean(each, axis=0)
        return self._means[1]


class SamplingSettings(EvaluatorSettings):
    """Try a random sample of the joint actions of the agents below."""

    kind: Literal["sampling"] = "sampling"
    factory: ClassVar[str] = f"{__name__}:Sampling"
    samples: Samples = 64
    """Joint actions of the agents below that are tried with each own action."""


class Sampling(Aggregation):
    """Tries a random sample of the joint actions below, the same ones for every own action.

    Drawn with equal probability, or from the empirical frequencies if these are the teammate model
    (then the plain mean estimates the weighted one). With no more joint actions than samples, all
    are tried.

    Raises
    ------
    ValueError
        If the teammate model is conditional on the own action.
    """

    def __init__(self, settings: SamplingSettings, problem: DecisionProblem) -> None:
        super().__init__(problem)
        if problem.teammates == "conditional":
            raise ValueError(
                "learner.decision.teammates = 'conditional': sampling evaluates best-response, "
                "uniform, empirical; use exact"
            )
        self.samples = settings.samples

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        below, a = self.hierarchy.below(deliberation.agent), self.n_actions
        frequencies, rng = deliberation.frequencies, deliberation.rng
        empirical = self.problem.teammates == "empirical"
        probabilities = None
        if a ** len(below) <= self.samples:
            tried = combinations(below, a)
            if empirical:
                probabilities = probabilities_of(frequencies, below)
        elif empirical:
            tried = self.drawn(frequencies[list(below)], self.samples, rng)
        else:
            tried = rng.integers(a, size=(self.samples, len(below)))
        return self.aggregate(deliberation, tried, probabilities)


class AutoSettings(EvaluatorSettings):
    """Exact enumeration as long as it is quick, then sampling, then best responses."""

    kind: Literal["auto"] = "auto"
    exact_up_to: Annotated[int, Field(ge=1, le=10)] = 5
    """Agents that may still be free for exact enumeration."""
    sampling_up_to: Annotated[int, Field(ge=1)] = 12
    """Agents that may still be free for sampling, if agents decide by their own value and expect
    best responses."""
    samples: Samples = 64
    """Joint actions that are tried by sampling, as of the evaluator ``sampling``."""

    def build(self, problem: DecisionProblem) -> Evaluator:
        """Return the evaluator of a team."""
        return self.chosen(problem).build(problem)

    def chosen(self, problem: DecisionProblem) -> EvaluatorSettings:
        """Return the settings of the evaluator that a team gets."""
        hierarchy = problem.hierarchy
        if problem.unseen == "plan" or problem.plan == "common":
            return EVALUATORS.parsed("best-response")
        free = max(1 + len(hierarchy.below(i)) for i in range(len(hierarchy)))
        if free <= self.exact_up_to and problem.n_actions ** (free - 1) <= MOST_JOINT_ACTIONS:
            return EVALUATORS.parsed("exact")
        is_large = free > self.sampling_up_to or problem.value_of != "own"
        if is_large and problem.teammates == "best-response":
            return EVALUATORS.parsed("best-response")
        return SamplingSettings(samples=self.samples)
