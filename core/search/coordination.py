"""Evaluators that find a joint action of all agents: coordination graphs and cross-entropy.

In a coordination graph the value of a team is a sum of parts, each over neighbors. Agent j
evaluates the joint actions of itself and its neighbors; all others are assumed to maintain. The
joint action with the greatest sum of these tables is found by variable elimination, exactly, or by
max-plus, in time linear in the number of agents. It is found once per decision. Each agent then
evaluates its own actions given the others' parts of this joint action. Ties are broken in favor of
its own part, so that agents agree without messages.

The cross-entropy method plans several decisions ahead: it is a model-predictive controller. The
first agent to decide plans for all. Sequences of joint actions are sampled, with one distribution
per agent and decision, and evaluated by the discounted sum of predicted rewards. The distributions
move to the frequencies among the best sequences, and sequences are sampled again (Rubinstein and
Kroese 2004; with a learned model Chua et al. 2018). The team takes the first joint action of the
best sequence, and plans again at the next decision. The method learns nothing and is given the
reward function: it is a control for learners.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.prediction import Prediction, rewards_of, states_of
from ..numerics import FloatArray, IntArray
from .coordination_graphs import Elimination, MaxPlus
from .enumeration import combinations
from .evaluator import Aggregation, DecisionContext, DecisionProblem, EvaluatorSettings

FIRST = 1e-9
"""Relative margin by which an agent prefers its own part of the joint action among ties."""


class VariableEliminationSettings(EvaluatorSettings):
    """The joint action of the greatest sum of values over neighbors, exactly."""

    kind: Literal["variable-elimination"] = "variable-elimination"

    def build(self, problem: DecisionProblem) -> Coordination:
        """Return the evaluator of a team."""
        return Coordination(problem, self.kind, Elimination)


class MaxPlusSettings(EvaluatorSettings):
    """Approximate maximum of a sum of values over neighbors, by messages between them."""

    kind: Literal["max-plus"] = "max-plus"
    rounds: Annotated[int, Field(ge=1, le=10_000)] = 100
    """Maximum number of rounds of messages."""
    damping: Annotated[float, Field(ge=0, lt=1)] = 0.5
    """Share of the previous message that is kept, in graphs with loops."""

    def build(self, problem: DecisionProblem) -> Coordination:
        """Return the evaluator of a team."""
        messages = partial(MaxPlus, rounds=self.rounds, damping=self.damping)
        return Coordination(problem, self.kind, messages)


class Coordination(Aggregation):
    """Values of own actions given the joint action that maximizes a sum of tables.

    Parameters
    ----------
    problem
        Properties that all decisions of the team share.
    name
        Name of the evaluator in messages.
    maximizer
        Finds the joint action of the greatest sum, for scopes, agents and actions.

    Raises
    ------
    ValueError
        If no agent has neighbors, the settings ask for other than own values and best responses,
        the coordination graph is too wide, or the budget is below the joint actions of all tables.
        Raised before memory is allocated.
    """

    def __init__(
        self, problem: DecisionProblem, name: str, maximizer: Callable[..., Elimination | MaxPlus]
    ) -> None:
        super().__init__(problem)
        self.name = name
        hierarchy = problem.hierarchy
        if hierarchy.edges or not hierarchy.neighbors:
            raise ValueError(
                f"learner.decision.evaluator = {name!r}: needs neighbors, but the topology has "
                "none; use coordination-graph"
            )
        required = (
            ("rule", problem.rule, "value"),
            ("teammates", problem.teammates, "best-response"),
            ("value_of", problem.value_of, "own"),
        )
        for key, value, allowed in required:
            why = f"{name} adds up own values over neighbors, allowed: {allowed!r}"
            self.require(key, value, allowed, why)
        n = len(hierarchy)
        self.scopes = [tuple(sorted((i, *hierarchy.searched(i)))) for i in range(n)]
        makers = len(problem.deciding) if problem.is_private else 1
        self.check_budget(makers * sum(self.n_actions ** len(scope) for scope in self.scopes))
        try:
            self._maximizer = maximizer(self.scopes, n, self.n_actions)
        except ValueError as error:
            raise ValueError(f"learner.decision.evaluator = {name!r}: {error}") from None
        sizes = set(map(len, self.scopes))
        self._tried = {k: combinations(tuple(range(k)), self.n_actions) for k in sizes}
        self._concerning = [[k for k, s in enumerate(self.scopes) if i in s] for i in range(n)]
        self._tables: list[FloatArray] = []
        self._best: IntArray = np.zeros(n, dtype=np.int64)

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = context.agent
        if self.begins(context):
            self._tables = [self._table(context, i) for i in range(len(self.scopes))]
            self._best = self._maximizer.best(self._tables)
        values = np.zeros(self.n_actions)
        for k in self._concerning[agent]:
            index = [slice(None) if i == agent else self._best[i] for i in self.scopes[k]]
            values += self._tables[k][tuple(index)]
        own = self._best[agent]
        margin = FIRST * max(1.0, abs(float(values[own])))
        is_equal = np.abs(values - values[own]) <= margin
        is_equal[own] = False
        values[is_equal] -= 2.0 * margin
        return values

    def _table(self, context: DecisionContext, agent: int) -> FloatArray:
        """Return an agent's values of the joint actions of its scope."""
        scope = self.scopes[agent]
        tried = self._tried[len(scope)]
        self.count(agent, len(tried))
        shape = (self.n_actions,) * len(scope)
        weights = context.weights[agent]
        if not weights.any():
            return np.zeros(shape)
        joint = context.joint_action[None].repeat(len(tried), axis=0)
        joint[:, list(scope)] = tried
        states = states_of(context.prediction, agent, joint)
        return self.rules.values(weights, states).reshape(shape)


class CrossEntropySettings(EvaluatorSettings):
    """Plan several decisions ahead by the cross-entropy method, by predicted rewards alone."""

    kind: Literal["cross-entropy"] = "cross-entropy"
    factory: ClassVar[str] = f"{__name__}:CrossEntropy"
    horizon: Annotated[int, Field(ge=1, le=50)] = 4
    """Number of decisions in a plan."""
    samples: Annotated[int, Field(ge=2, le=100_000)] = 32
    """Plans sampled per iteration."""
    iterations: Annotated[int, Field(ge=1, le=100)] = 3
    """Number of iterations."""
    elite: Annotated[float, Field(gt=0, le=1)] = 0.25
    """Fraction of best plans whose action frequencies define the next distribution."""
    smoothing: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Weight of the uniform distribution in the next distribution."""


class CrossEntropy(Aggregation):
    """Gives value one to the planned action of an agent and zero to the others.

    Raises
    ------
    ValueError
        If the decision rule is not ``reward``, no agent is above all others to plan for them, or
        the budget is below one iteration.
    """

    continues = True
    """The method needs predictions with ``after``."""

    def __init__(self, settings: CrossEntropySettings, problem: DecisionProblem) -> None:
        super().__init__(problem)
        self.require("rule", problem.rule, "reward", f"{settings.kind} plans by 'reward' only")
        hierarchy = problem.hierarchy
        if len(hierarchy.searched(hierarchy.order[0])) < len(hierarchy) - 1:
            raise ValueError(
                f"learner.decision.evaluator = {settings.kind!r}: needs a topology whose first "
                "agent is above all others and plans for them, as in a chain"
            )
        self.settings = settings
        self.name = settings.kind
        self._iterations = settings.iterations
        if problem.budget is not None:
            planners = len(problem.deciding) if problem.is_private else 1
            iteration = planners * settings.samples * settings.horizon
            self.check_budget(iteration)
            self._iterations = min(settings.iterations, problem.budget // iteration)
        self._plan: IntArray = np.zeros(len(hierarchy), dtype=np.int64)

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        if self.begins(context):
            self._plan = self._planned(context)
        values = np.zeros(self.n_actions)
        values[self._plan[context.agent]] = 1.0
        return values

    def _planned(self, context: DecisionContext) -> IntArray:
        """Return the joint action ``(n,)`` that the best plan begins with."""
        s, rng = self.settings, context.rng
        prediction = context.prediction
        shape = s.horizon, len(self.hierarchy), self.n_actions
        probabilities = np.full(shape, 1.0 / self.n_actions)
        n_elite = max(1, round(s.elite * s.samples))
        elite: IntArray = np.zeros((0, *shape[:2]), dtype=np.int64)
        for _ in range(self._iterations):
            plans = self.sample(probabilities, s.samples, rng)
            plans[: len(elite[:1])] = elite[:1]  # the best so far
            worths = self._worths(context.agent, prediction, plans)
            elite = plans[np.argsort(-worths, kind="stable")[:n_elite]]
            seen = (elite[..., None] == np.arange(self.n_actions)).mean(axis=0)
            probabilities = s.smoothing / self.n_actions + (1.0 - s.smoothing) * seen
        return elite[0, 0]

    def _worths(self, agent: int, prediction: Prediction, plans: IntArray) -> FloatArray:
        """Return the discounted rewards ``(samples,)`` of plans ``(samples, horizon, n)``."""
        worths = np.zeros(len(plans))
        waiting = [(prediction, np.arange(len(plans)), 0)]
        while waiting:
            seen, rows, step = waiting.pop()
            tried, which = np.unique(plans[rows, step], axis=0, return_inverse=True)
            which = which.reshape(-1)
            self.count(agent, len(tried))
            worths[rows] += self.problem.discount**step * rewards_of(seen, tried)[which]
            if step + 1 == self.settings.horizon:
                continue
            for k, joint in enumerate(tried):
                onward = seen.after(joint)
                assert onward is not None  # see `Evaluator.continues`
                waiting.append((onward, rows[which == k], step + 1))
        return worths
