"""Adapters for learners, evaluators and explorers of users that do not inherit a base class.

This is the only module that looks up their optional members by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import signature
from typing import Any, Self

import numpy as np

from ..interface.agents import Counts
from ..learners.learner import Learner
from ..numerics import FloatArray, IntArray
from ..search.evaluator import DecisionContext, Evaluator
from ..search.exploration import Explorer, no_way_on


def as_learner(thing: Any) -> Learner:
    """Return an object as a learner, with an adapter if it does not inherit from `Learner`."""
    return thing if isinstance(thing, Learner) else PlainLearner(thing)


def as_evaluator(thing: Any) -> Evaluator:
    """Return an object as an evaluator, with an adapter if it is not an `Evaluator`."""
    return thing if isinstance(thing, Evaluator) else PlainEvaluator(thing)


def as_explorer(thing: Any) -> Explorer:
    """Return an object as an explorer, with an adapter if it is not an `Explorer`."""
    return thing if isinstance(thing, Explorer) else PlainExplorer(thing)


class PlainLearner(Learner):
    """Adapter for a learner that does not inherit from `Learner`.

    Its method ``observe`` also receives the states and actions of the decision if it has
    parameters ``left`` and ``joint_action``, as learners of action values need.

    Parameters
    ----------
    plain
        Object with the required members of a learner.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._more = signature(plain.observe).parameters.keys() & {"left", "joint_action"}

    @property
    def theta(self) -> FloatArray:  # type: ignore[override]  # users may replace the array
        """The consequent weights."""
        theta: FloatArray = self.plain.theta
        return theta

    def begin_episode(self) -> None:
        """Start an episode."""
        self.plain.begin_episode()

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Learn from the states entered."""
        return int(self.plain.observe(states, reward, terminated))

    def observe_decision(
        self,
        left: FloatArray,
        joint_action: IntArray,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
    ) -> int:
        """Learn from a decision, as far as the user's method has parameters for it."""
        known = {"left": left, "joint_action": joint_action}
        more = {name: known[name] for name in self._more}
        return int(self.plain.observe(states, reward, terminated, **more))

    def end_episode(self) -> int:
        """Make the updates that follow an episode."""
        return int(self.plain.end_episode())

    def arrays(self) -> dict[str, FloatArray]:
        """Return the saved state."""
        arrays: dict[str, FloatArray] = self.plain.arrays()
        return arrays

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from a saved state."""
        self.plain.restore(arrays)

    def continue_from(self, former: Self, rows: IntArray) -> None:
        """Start from the weights of another learner, if the user's class supports it."""
        if getattr(self.plain, "continue_from", None) is None:
            raise ValueError(no_way_on("learner.kind", self.plain))
        self.plain.continue_from(former.plain, rows)


class PlainEvaluator(Evaluator):
    """Adapter for an evaluator that does not inherit from `Evaluator`.

    Parameters
    ----------
    plain
        Object with ``values(context)`` and, optionally, ``counts``.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self.counts: Counts = getattr(plain, "counts", Counts())

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        values: FloatArray = self.plain.values(context)
        return values


class PlainExplorer(Explorer):
    """Adapter for an explorer that does not inherit from `Explorer`.

    Parameters
    ----------
    plain
        Object with ``memory``, ``begin_episode``, ``choose`` and ``advance``.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain

    @property
    def memory(self) -> FloatArray:  # type: ignore[override]  # users may replace the array
        """The complete state."""
        memory: FloatArray = self.plain.memory
        return memory

    def begin_episode(self) -> None:
        """Start an episode of training."""
        self.plain.begin_episode()

    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Return the action of `agent`."""
        return int(self.plain.choose(agent, values, rng))

    def advance(self) -> None:
        """Advance to the next step."""
        self.plain.advance()

    def continue_from(self, former: Self) -> None:
        """Continue from an explorer of other agents, if the user's class supports it."""
        if getattr(self.plain, "continue_from", None) is None:
            raise ValueError(no_way_on("learner.exploration.kind", self.plain))
        self.plain.continue_from(former.plain)
