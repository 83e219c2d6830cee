"""Evaluators that find what all do at once: in coordination graphs, or by planning ahead.

In a coordination graph a team's value is a sum of parts, each over neighbours. Agent j values the
joint actions of itself and its neighbours; all others are taken to maintain. These values, a table
for each agent, are added up, and the joint action of the greatest sum is found: by variable
elimination, exactly, or by max-plus, in time that is linear in the number of agents. It is found
once for all agents of a decision. Each then values its own actions given that all others do their
part of it. Where actions are equally good its own part comes first, so that agents who are told
nothing agree.

The cross-entropy method plans several decisions: a model-predictive controller. The first agent to
decide plans for all. Sequences of joint actions are drawn, each agent and each
decision by probabilities of their own, and valued by the discounted sum of the rewards that are
predicted on the way, from predicted states. The probabilities move to the frequencies among the
best sequences, and sequences are drawn anew (Rubinstein and Kroese 2004; as a controller with a
learned model Chua et al. 2018). What the best sequence begins with is done; the next decision plans
from nothing. It learns nothing and has the reward function: a control for what does learn.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..coordination.graphs import Elimination, MaxPlus
from ..interface.prediction import Prediction, rewards_of
from ..numerics import FloatArray, IntArray
from .enumeration import combinations
from .evaluator import Aggregation, DecisionProblem, Deliberation, EvaluatorSettings

FIRST = 1e-9
"""By how much, relative to the value, an agent's own part comes before what is equally good."""


class VariableEliminationSettings(EvaluatorSettings):
    """The joint action of the greatest sum of values over neighbours, exactly."""

    kind: Literal["variable-elimination"] = "variable-elimination"

    def build(self, problem: DecisionProblem) -> Coordination:
        """Return the evaluator of a team."""
        return Coordination(problem, self.kind, Elimination)


class MaxPlusSettings(EvaluatorSettings):
    """The joint action of a great sum of values over neighbours, by messages between them."""

    kind: Literal["max-plus"] = "max-plus"
    rounds: Annotated[int, Field(ge=1, le=10_000)] = 100
    """Most rounds of messages."""
    damping: Annotated[float, Field(ge=0, lt=1)] = 0.5
    """Share of a message that is kept from the round before; in a graph without loops none is."""

    def build(self, problem: DecisionProblem) -> Coordination:
        """Return the evaluator of a team."""
        messages = partial(MaxPlus, rounds=self.rounds, damping=self.damping)
        return Coordination(problem, self.kind, messages)


class Coordination(Aggregation):
    """Tables of values, and what is made of the joint action of their greatest sum.

    Parameters
    ----------
    problem
        What all decisions have in common.
    name
        Of the evaluator, in messages.
    maximiser
        Finds the joint action of the greatest sum, for scopes, agents and actions.

    Raises
    ------
    ValueError
        If nobody has neighbours, anything but own values and best responses is asked for, or the
        coordination graph is too wide; in one line, before anything is allocated.
    """

    def __init__(
        self, problem: DecisionProblem, name: str, maximiser: Callable[..., Elimination | MaxPlus]
    ) -> None:
        super().__init__(problem)
        hierarchy = problem.hierarchy
        if hierarchy.edges or not hierarchy.neighbors:
            raise ValueError(
                f"learner.decision.evaluator = {name!r}: the topology joins no neighbours, "
                "use coordination-graph"
            )
        required = (
            ("rule", problem.rule, "value"),
            ("teammates", problem.teammates, "best-response"),
            ("value_of", problem.value_of, "own"),
        )
        for key, value, allowed in required:
            why = f"{name} adds up own values over neighbours, allowed: {allowed!r}"
            self.require(key, value, allowed, why)
        n = len(hierarchy)
        self.scopes = [tuple(sorted((i, *hierarchy.searched(i)))) for i in range(n)]
        try:
            self._maximiser = maximiser(self.scopes, n, self.n_actions)
        except ValueError as error:
            raise ValueError(f"learner.decision.evaluator = {name!r}: {error}") from None
        sizes = set(map(len, self.scopes))
        self._tried = {k: combinations(tuple(range(k)), self.n_actions) for k in sizes}
        self._concerning = [[k for k, s in enumerate(self.scopes) if i in s] for i in range(n)]
        self._tables: list[FloatArray] = []
        self._best: IntArray = np.zeros(n, dtype=np.int64)

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = deliberation.agent
        if self.begins(deliberation):
            self._tables = [self._table(deliberation, i) for i in range(len(self.scopes))]
            self._best = self._maximiser.best(self._tables)
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

    def _table(self, deliberation: Deliberation, agent: int) -> FloatArray:
        """Return what an agent's value makes of the joint actions of its scope."""
        scope = self.scopes[agent]
        tried = self._tried[len(scope)]
        self.count(agent, len(tried))
        shape = (self.n_actions,) * len(scope)
        weights = deliberation.weights[agent]
        if not weights.any():
            return np.zeros(shape)
        joint = deliberation.joint_action[None].repeat(len(tried), axis=0)
        joint[:, list(scope)] = tried
        states = deliberation.prediction.states(agent, joint)
        return self.rules.values(weights, states).reshape(shape)


class CrossEntropySettings(EvaluatorSettings):
    """Plan several decisions ahead by the cross-entropy method; decides by rewards alone."""

    kind: Literal["cross-entropy"] = "cross-entropy"
    factory: ClassVar[str] = f"{__name__}:CrossEntropy"
    horizon: Annotated[int, Field(ge=1, le=50)] = 4
    """Decisions that a plan looks ahead."""
    samples: Annotated[int, Field(ge=2, le=100_000)] = 32
    """Plans that are drawn in an iteration."""
    iterations: Annotated[int, Field(ge=1, le=100)] = 3
    """How often plans are drawn."""
    elite: Annotated[float, Field(gt=0, le=1)] = 0.25
    """Fraction of the plans of an iteration whose frequencies the next one draws by."""
    smoothing: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Weight of equal probabilities in those that the next iteration draws by."""


class CrossEntropy(Aggregation):
    """Gives one to the action that the plan holds for an agent, and zero to the others.

    Raises
    ------
    ValueError
        If it is not to decide by rewards, or nobody is above all others and could plan for them.
    """

    continues = True
    """It needs a prediction with ``after``."""

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
        self._plan: IntArray = np.zeros(len(hierarchy), dtype=np.int64)

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        if self.begins(deliberation):
            self._plan = self._planned(deliberation)
        values = np.zeros(self.n_actions)
        values[self._plan[deliberation.agent]] = 1.0
        return values

    def _planned(self, deliberation: Deliberation) -> IntArray:
        """Return the joint action ``(n,)`` that the best plan begins with."""
        s, rng = self.settings, deliberation.rng
        prediction = deliberation.prediction
        shape = s.horizon, len(self.hierarchy), self.n_actions
        probabilities = np.full(shape, 1.0 / self.n_actions)
        n_elite = max(1, round(s.elite * s.samples))
        elite: IntArray = np.zeros((0, *shape[:2]), dtype=np.int64)
        for _ in range(s.iterations):
            plans = self.drawn(probabilities, s.samples, rng)
            plans[: len(elite[:1])] = elite[:1]  # the best so far
            worths = self._worths(deliberation.agent, prediction, plans)
            elite = plans[np.argsort(-worths, kind="stable")[:n_elite]]
            seen = (elite[..., None] == np.arange(self.n_actions)).mean(axis=0)
            probabilities = s.smoothing / self.n_actions + (1.0 - s.smoothing) * seen
        return elite[0, 0]

    def _worths(self, agent: int, prediction: Prediction, plans: IntArray) -> FloatArray:
        """Return what plans ``(samples, horizon, n)`` are paid, predicted once where they agree."""
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
                if onward is None:
                    raise ValueError(f"{type(seen).__name__} does not go on")
                waiting.append((onward, rows[which == k], step + 1))
        return worths
