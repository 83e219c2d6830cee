"""Evaluators for coordination graphs: a team's value is a sum of parts, each over neighbours.

Agent j values the joint actions of itself and its neighbours; all others are taken to maintain.
These values, a table for each agent, are added up, and the joint action of the greatest sum is
found: by variable elimination, exactly, or by max-plus, in time that is linear in the number of
agents. It is found once for all agents of a decision. Each then values its own actions given that
all others do their part of it. Where actions are equally good its own part comes first, so that
agents who are told nothing agree.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ..coordination.graphs import Elimination, MaxPlus, Scope
from ..interface.spaces import Prediction
from ..numerics import FloatArray, IntArray
from .evaluator import Aggregation, DecisionProblem, Deliberation, EvaluatorSettings, combinations

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
        if hierarchy.edges or not hierarchy.neighbours:
            raise ValueError(
                f"learner.decision.evaluator = {name!r}: the topology joins no neighbours, "
                "use coordination-graph"
            )
        allowed = {"rule": "value", "teammates": "best-response", "value_of": "own"}
        for key, value in allowed.items():
            why = f"{name} adds up own values over neighbours, allowed: {value!r}"
            self.require(key, value, why)
        n = len(hierarchy)
        self.scopes: tuple[Scope, ...] = tuple(
            tuple(sorted((i, *hierarchy.below(i)))) for i in range(n)
        )
        try:
            self._maximiser = maximiser(self.scopes, n, self.n_actions)
        except ValueError as error:
            raise ValueError(f"learner.decision.evaluator = {name!r}: {error}") from None
        sizes = set(map(len, self.scopes))
        self._tried = {k: combinations(tuple(range(k)), self.n_actions) for k in sizes}
        self._concerning = [[k for k, s in enumerate(self.scopes) if i in s] for i in range(n)]
        self._prediction: Prediction | None = None
        self._tables: list[FloatArray] = []
        self._best: IntArray = np.zeros(n, dtype=np.int64)

    def values(self, deliberation: Deliberation) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        agent = deliberation.agent
        if agent == self.hierarchy.order[0] or deliberation.prediction is not self._prediction:
            self._prediction = deliberation.prediction
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
        joint = np.tile(deliberation.joint_action, (len(tried), 1))
        joint[:, list(scope)] = tried
        states = deliberation.prediction.states(agent, joint)
        return self.rules.values(weights, states).reshape(shape)
